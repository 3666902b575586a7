// @ts-check
// The parts of <modar-viewer> and how they look. BASE is for the pages around it, too, which have
// buttons and dialogs of the same kind.

export const BASE = `
:root, :host {
  --paper: var(--modar-paper, #f4f0e7);
  --card: var(--modar-card, #fbf9f4);
  --ink: var(--modar-ink, #1d1b18);
  --soft: #645d52;
  --rule: #cfc7b8;
  --accent: var(--modar-accent, #8c2f1b);
  --serif: var(--modar-font, "Iowan Old Style", "Palatino Linotype", Palatino, "Book Antiqua", "URW Palladio L", P052, Georgia, serif);
  --shadow: 0 .1rem .2rem rgb(0 0 0 / .12), 0 .6rem 1.8rem rgb(0 0 0 / .18);
}
* { box-sizing: border-box; }
[hidden] { display: none !important; }
h1, h2, p, figure { margin: 0; }
h2 { font-size: 1.25rem; font-weight: 600; line-height: 1.25; }
.small { font-size: .875rem; line-height: 1.45; color: var(--soft); }
:focus-visible { outline: .18rem solid var(--accent); outline-offset: .2rem; }
button, .button, select {
  font: inherit; min-height: 2.9rem; padding: .55rem 1.35rem; border: 1px solid var(--ink); border-radius: 0;
  background: var(--ink); color: var(--card); cursor: pointer; text-decoration: none; display: inline-flex; align-items: center;
}
button:hover, .button:hover { background: #3a352e; }
button:disabled { opacity: .5; cursor: progress; }
.link { min-height: 0; padding: 0; border: 0; background: none; color: inherit; text-decoration: underline; }
.link:hover { background: none; color: var(--ink); }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
.quiet { background: none; color: var(--ink); }
.quiet:hover { background: rgb(0 0 0 / .06); }
select { background: var(--card); color: var(--ink); width: 100%; }
.row { display: flex; flex-wrap: wrap; gap: .6rem; }
/* Icons keep their size where text is enlarged: what grows then needs the room. */
.tool, ::slotted(.tool) {
  width: 51px; height: 51px; min-height: 0; flex: none; padding: 0; justify-content: center; border: 0; border-radius: 50%;
  background: rgb(20 18 16 / .55); color: #fff; fill: none; stroke: currentColor; stroke-width: 1.6; stroke-linecap: round; stroke-linejoin: round;
}
.tool:hover, ::slotted(.tool:hover) { background: rgb(20 18 16 / .8); }
.tool:focus-visible { outline-color: #fff; outline-offset: -.3rem; }
.tool[aria-pressed="true"] { background: var(--card); color: var(--ink); }
.tool svg { width: 25px; height: 25px; }
.tool .full { fill: currentColor; stroke: none; }
@media (orientation: landscape) and (max-height: 36rem) { .tool, ::slotted(.tool) { width: 46px; height: 46px; } }
.dialog {
  border: 0; border-top: 3px solid var(--accent); background: var(--card); color: var(--ink); box-shadow: var(--shadow);
  padding: 1.5rem; width: min(30rem, calc(100vw - 2rem)); max-height: calc(100vh - 2rem);
}
.dialog::backdrop { background: rgb(20 18 16 / .6); }
.dialog[open] { display: grid; gap: 1rem; }
.qr { width: 160px; image-rendering: pixelated; }
@media (prefers-reduced-motion: reduce) { * { transition: none !important; } }
`;

export const STYLE = `
:host { display: grid; aspect-ratio: 4 / 3; }
:host([bare]) { display: contents; }
:host([bare]) #cover { display: none; }
#all { display: contents; font: 1.0625rem/1.5 var(--serif); color: var(--ink); -webkit-text-size-adjust: 100%; }

/* ---- before the start ---- */
#cover { display: grid; grid-template-rows: minmax(9rem, 1fr) auto; background: var(--paper); }
#frame { position: relative; margin: .8rem .8rem 0; }
#poster, ::slotted([slot="poster"]) { position: absolute; inset: 0; width: 100%; height: 100%; object-fit: contain; }
#begin { display: grid; gap: .6rem; padding: .8rem 1rem; justify-items: center; text-align: center; }
#begin .row { justify-content: center; font-size: .9375rem; }
#progress { color: var(--accent); }
#progress:empty { display: none; }

/* ---- the stage: a dialog, and within it what can fill the screen ---- */
#stage { position: fixed; inset: 0; width: 100%; height: 100%; max-width: none; max-height: none; margin: 0; padding: 0; border: 0; overflow: hidden; background: #000; }
#stage:not([open]) { display: none; }
#screen { position: absolute; inset: 0; background: #000; overflow: hidden; touch-action: none; user-select: none; -webkit-user-select: none; }
#screen canvas { position: absolute; inset: 0; width: 100%; height: 100%; }
/* A focal length that is being estimated moves models in their first frames. */
#models { transition: opacity .35s; }
:host([state="looking"]) #models { opacity: 0; }
#models:focus-visible { outline-color: #fff; outline-offset: -.3rem; }
/* Browsers give no frames of a video that is not displayed. */
#video { position: absolute; width: 2px; height: 2px; opacity: .01; pointer-events: none; }
#ground { position: absolute; left: 0; top: 0; transform-origin: 0 0; box-shadow: 0 0 0 1px rgb(0 0 0 / .12); }
#which { position: absolute; top: calc(.8rem + env(safe-area-inset-top)); inset-inline-start: calc(1rem + env(safe-area-inset-left)); max-width: min(20rem, calc(100% - 6rem)); }
/* A table in daylight, from which the model's own shadow stands out. */
:host([state="around"]) #screen { background: radial-gradient(circle at 50% 40%, #f8f5ee, #ded7c8); }
:host([state="around"]) #picture, :host([state="around"]) #hint { display: none; }
:host([state="around"]) #tools { background: none; }
:host([state="around"]) .camera, :host(:not([state="around"])) .around { display: none; }
/* Captions above the label or the hint. */
#said {
  position: absolute; display: flex; flex-direction: column; justify-content: flex-end; align-items: start; gap: .6rem; pointer-events: none;
  left: calc(16px + env(safe-area-inset-left)); bottom: calc(99px + env(safe-area-inset-bottom)); width: min(23rem, calc(100% - 84px));
  max-height: min(60%, calc(100% - 99px - 4.6rem - 155px));
}
/* Next to the buttons of sound and video. */
@media (orientation: portrait), (min-height: 36rem) {
  #said.above { bottom: auto; top: calc(4.6rem + 49px + env(safe-area-inset-top)); left: calc(64px + env(safe-area-inset-left)); width: min(23rem, calc(100% - 132px)); }
}
#hint, #label { flex: 0 3 auto; min-height: min(4rem, 64px); max-width: 100%; overflow-y: auto; overflow-wrap: break-word; background: var(--card); color: var(--ink); box-shadow: var(--shadow); padding: .8rem 1rem; }
#cue { min-height: min(2rem, 40px); max-width: 100%; overflow: hidden; padding: .3rem .6rem; background: rgb(0 0 0 / .8); color: #fff; white-space: pre-line; }
#cue:empty { display: none; }
#label-open { pointer-events: auto; }
#label-close { position: absolute; top: 3px; inset-inline-end: 3px; width: 42px; height: 42px; background: none; color: inherit; }
#label-name { padding-inline-end: 34px; }
#label-close:focus-visible { outline-color: var(--accent); }
#hint { display: flex; flex-wrap: wrap; gap: .9rem; align-items: center; }
:host([state="seen"]) #hint { display: none; }
#plates { display: flex; gap: .35rem; flex: none; }
#plates img { display: block; background: var(--card); border: 1px solid var(--rule); width: auto; height: 67px; max-width: 96px; padding: .2rem; object-fit: contain; }
#plates.many img { height: 46px; max-width: 48px; }
#label { position: relative; border-left: 3px solid var(--accent); pointer-events: auto; user-select: text; -webkit-user-select: text; }
#label p { margin-top: .3rem; font-size: 1rem; }
#label p:empty { display: none; }
#heard { margin-top: .3rem; white-space: pre-line; }
#heard summary { cursor: pointer; min-height: 1.5rem; }
/* Their points move with the picture, their size does not. */
#rest { position: absolute; top: 0; left: 0; width: 100%; height: .3rem; accent-color: var(--accent); }
#marks { position: absolute; inset: 0; overflow: hidden; pointer-events: none; }
#marks button {
  position: absolute; left: 0; top: 0; min-width: 2.4rem; min-height: 2.4rem; padding: 0 .5rem; justify-content: center;
  margin: -1.2rem 0 0 -1.2rem; border: 2px solid var(--card); border-radius: 1.2rem; background: var(--ink); color: var(--card);
  font-size: 1rem; font-weight: 600; line-height: 1; pointer-events: auto; box-shadow: var(--shadow);
}
#marks button[data-covered] { opacity: .4; }
#handles {
  position: absolute; inset-inline-end: calc(10px + env(safe-area-inset-right)); top: calc(16px + env(safe-area-inset-top));
  height: calc(100% - 130px); display: flex; flex-flow: column wrap-reverse; justify-content: center; gap: 7px; pointer-events: none;
}
#media { position: absolute; inset-inline-start: calc(10px + env(safe-area-inset-left)); top: calc(4.6rem + env(safe-area-inset-top)); display: grid; gap: 7px; }
#volume { width: 112px; height: 42px; accent-color: var(--card); }
#handles button, #media button { width: 42px; height: 42px; pointer-events: auto; }
#media .row { gap: 5px; }
#tools {
  position: absolute; left: 0; right: 0; bottom: 0; display: flex; flex-wrap: wrap-reverse; gap: 8px; justify-content: center; align-items: center;
  padding: 14px 8px calc(16px + env(safe-area-inset-bottom)); background: linear-gradient(transparent, rgb(0 0 0 / .45));
}
@media (orientation: landscape) and (max-height: 36rem) {
  #tools {
    left: auto; top: 0; flex-flow: column wrap-reverse; padding: 16px calc(16px + env(safe-area-inset-right)) 16px 22px;
    background: linear-gradient(90deg, transparent, rgb(0 0 0 / .45));
  }
  #handles {
    inset-inline-end: auto; left: calc(10px + env(safe-area-inset-left)); top: 10px; height: auto; flex-flow: row wrap; justify-content: start;
    max-width: 60%;
  }
  :host([state="around"]) #which { top: 62px; }
  #said { bottom: calc(16px + env(safe-area-inset-bottom)); width: min(20rem, 50%); max-height: calc(100% - 92px - 2.9rem); }
  #media { top: auto; bottom: 16px; inset-inline-start: auto; inset-inline-end: calc(86px + env(safe-area-inset-right)); }
}

/* ---- dialogs ---- */
#choose-list { display: grid; gap: .5rem; }
#choose-list label { display: flex; gap: .7rem; align-items: center; min-height: 2.9rem; border-bottom: 1px solid var(--rule); cursor: pointer; }
#choose-list input { width: 1.2rem; height: 1.2rem; accent-color: var(--accent); }
#leave-address { overflow-wrap: anywhere; }
#problem-detail:empty { display: none; }
`;

/** @param {string} drawing */
const icon = (drawing) => `<svg viewBox="0 0 24 24" aria-hidden="true">${drawing}</svg>`;
/** @type {(id: string, label: string, drawing: string, kind?: string, more?: string) => string} */
const tool = (id, label, drawing, kind = '', more = '') => `<button id="${id}" class="tool ${
    kind}" type="button" data-label="${label}" ${more}>${icon(drawing)}</button>`;

const MARKUP = `<div id="all">
<div id="cover">
  <div id="frame"><slot name="poster"><img id="poster" alt="" hidden></slot></div>
  <div id="begin">
    <p class="row"><button id="start" type="button" data-word="start"></button><button id="look" type="button" class="quiet" data-word="lookAround"></button></p>
    <p id="progress" role="status"></p>
    <p class="small" data-word="privacy"></p>
  </div>
</div>
<dialog id="stage" data-label="stage"><div id="screen">
  <video id="video" playsinline muted aria-hidden="true" tabindex="-1"></video>
  <canvas id="picture" aria-hidden="true"></canvas>
  <img id="ground" alt="" hidden>
  <canvas id="models" role="application" tabindex="0" aria-describedby="keys"></canvas>
  <progress id="rest" hidden></progress>
  <p id="keys" class="unseen" data-word="keys"></p>
  <p id="which" hidden><label class="unseen" for="scene" data-word="scene"></label><select id="scene"></select></p>
  <div id="said"><p id="cue"></p>
    <aside id="hint"><div id="plates" aria-hidden="true"></div><p id="reason" role="status"></p></aside>
    ${tool('label-open', 'showLabel', '<path d="M5 7h14M5 12h14M5 17h9"/>', '', 'hidden')}
    <article id="label" hidden>${
    tool(
        'label-close', 'hideLabel',
        '<path d="M7 7l10 10M17 7L7 17"/>')}<div aria-live="polite"><h2 id="label-name"></h2><p id="label-text"></p></div><details id="heard" hidden><summary data-word="transcript"></summary><p id="heard-text"></p></details></article></div>
  <div id="marks" role="group" data-label="labels"></div>
  <div id="media" role="toolbar" data-label="media" aria-orientation="vertical" hidden>
    <div class="row">${
    tool(
        'sound', 'sound',
        '<path d="M4 9.5h3.5L12 5.5v13l-4.5-4H4zM15.5 9a4.2 4.2 0 0 1 0 6M18 6.5a7.8 7.8 0 0 1 0 11"/>',
        '', 'aria-pressed="false"')}
    <input id="volume" type="range" max="1" step=".1" value="1" data-label="volume" hidden></div>
    ${tool('pause', 'pause', '<path d="M8.5 5.5v13M15.5 5.5v13"/>', '', 'aria-pressed="false"')}
    ${
    tool(
        'captions', 'captions',
        '<path d="M3.5 5.5h17v13h-17zM11 10.5a2.2 2.2 0 1 0 0 3M17 10.5a2.2 2.2 0 1 0 0 3"/>', '',
        'aria-pressed="true"')}
  </div>
  <div id="handles" role="toolbar" data-label="handles" aria-orientation="vertical">
    ${tool('turn-left', 'turnLeft', '<path d="M5 12a7 7 0 1 0 2.5-5.4M5 4v4.5h4.5"/>')}
    ${tool('turn-right', 'turnRight', '<path d="M19 12a7 7 0 1 1-2.5-5.4M19 4v4.5h-4.5"/>')}
    ${tool('larger', 'larger', '<path d="M12 5v14M5 12h14"/>')}
    ${tool('smaller', 'smaller', '<path d="M5 12h14"/>')}
    ${tool('higher', 'higher', '<path d="M6 14l6-6 6 6"/>', 'around')}
    ${tool('lower', 'lower', '<path d="M6 10l6 6 6-6"/>', 'around')}
    ${
    tool(
        'reset', 'reset',
        '<path d="M12 4l8 8-8 8-8-8z"/><circle cx="12" cy="12" r="1.2" class="full"/>')}
  </div>
  <div id="tools" role="toolbar" data-label="tools">
    ${tool('close', 'close', '<path d="M5 5l14 14M19 5L5 19"/>')}
    ${
    tool(
        'flip', 'flip',
        '<path d="M4 9a8.5 8.5 0 0 1 15-2m1-4v4.5h-4.5M20 15a8.5 8.5 0 0 1-15 2m-1 4v-4.5h4.5"/>',
        'camera', 'hidden')}
    <slot name="tools"></slot>
    ${
    tool(
        'torch', 'torch', '<path d="M13 2.5L6 13.5h5l-1 8 7-11h-5z"/>', 'camera',
        'aria-pressed="false" hidden')}
    ${
    tool(
        'cameras', 'cameras',
        '<path d="M3 7.5h4l2-2.5h6l2 2.5h4v11.5H3z"/><circle cx="12" cy="13" r="3.6"/>', 'camera')}
    ${tool('full', 'full', '<path d="M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"/>', '', 'hidden')}
  </div>
</div></dialog>
<dialog id="choose" class="dialog" aria-labelledby="choose-title">
  <h2 id="choose-title" data-word="cameras"></h2>
  <div id="choose-list"></div>
  <p class="small" data-word="keys"></p>
  <p class="row"><button id="choose-close" type="button" class="quiet" data-word="back"></button></p>
</dialog>
<dialog id="leave" class="dialog" aria-labelledby="leave-title">
  <h2 id="leave-title" data-word="leave"></h2>
  <p id="leave-address"></p>
  <p class="row"><a id="leave-open" class="button" target="_blank" rel="noopener noreferrer" data-word="open"></a><button id="leave-close" type="button" class="quiet" data-word="back"></button></p>
</dialog>
<dialog id="problem" class="dialog" role="alertdialog" aria-labelledby="problem-title" aria-describedby="problem-cure">
  <h2 id="problem-title"></h2>
  <p id="problem-cure"></p>
  <canvas id="qr" class="qr" role="img" data-label="qr" hidden></canvas>
  <p class="small" id="problem-detail"></p>
  <p class="row"><button id="copy" type="button" data-word="copyAddress" hidden></button><button id="again" type="button" data-word="again"></button><button id="look-instead" type="button" class="quiet" data-word="lookAround"></button><button id="problem-close" type="button" class="quiet" data-word="back"></button></p>
</dialog>
</div>`;

/**
 * Makes a document or a shadow root look so, under a Content-Security-Policy that allows no styles
 * in the page, too.
 * @param {Document | ShadowRoot} root
 * @param {string} css
 */
export function adopt(root, css) {
  try {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(css);
    root.adoptedStyleSheets = [...root.adoptedStyleSheets, sheet];
  } catch {  // Safari before 16.4
    const href = URL.createObjectURL(new Blob([css], {type: 'text/css'}));
    ('head' in root ? root.head : root)
        .append(Object.assign(document.createElement('link'), {rel: 'stylesheet', href}));
  }
}

/**
 * The parts in a new shadow root.
 * @param {HTMLElement} host
 */
export function build(host) {
  const root = host.attachShadow({mode: 'open'});
  const template = document.createElement('template');
  template.innerHTML = MARKUP;
  root.append(template.content);
  adopt(root, BASE + STYLE);
  return root;
}
