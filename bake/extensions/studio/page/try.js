// @ts-check
// Step 4: the bundle as visitors will see it, with this machine's camera, on a video, or on a
// phone next to it.
import {ask, askJson} from './api.js';
import {load as openTracker} from './engine/modar.js';
import {View} from './engine/modar-view.js';
import {button, finding, head, icon, part, tool} from './parts.js';
import {state, tellError} from './state.js';
import {said, t} from './words.js';

const m = window.m;
const CAMERA = {
  video: {facingMode: 'environment', width: {ideal: 1280}, height: {ideal: 720}},
  audio: false
};

/**
 * The played bundle, from the request until it is closed. Events to `told`: found(names),
 * failed(error).
 */
class Player {
  /** @type {import('./engine/modar.js').Modar | null} */
  #tracker = null;
  #ended = false;
  /** @type {Set<string>} */
  #seen = new Set();

  /**
   * @param {HTMLElement} box
   * @param {{ found(names: string[]): void, failed(error: Studio.Wrong): void }} told
   */
  constructor(box, told) {
    this.told = told;
    this.box = box;
    this.video = part(box, 'video', HTMLVideoElement);
    this.layers = {
      picture: part(box, '.picture', HTMLCanvasElement),
      models: part(box, '.models', HTMLCanvasElement)
    };
    this.address = '';
  }

  /** @param {MediaStream | Blob} source a stream of a camera, or a file */
  async play(source) {
    const bytes = new Uint8Array(await (await ask('GET', 'bundle')).arrayBuffer());
    const [view, tracker] =
        await Promise.all([View.create(bytes.slice(), this.layers), openTracker(bytes)]);
    if (this.#ended) {
      tracker.close();
      return;
    }
    this.#tracker = tracker;
    tracker.addEventListener('frame', ({detail}) => view.draw(detail));
    tracker.addEventListener('dropped', ({detail}) => view.show(detail.source));
    tracker.addEventListener('found', ({detail}) => this.#know(detail.name, true));
    tracker.addEventListener('lost', ({detail}) => this.#know(detail.name, false));
    tracker.addEventListener('error', ({detail}) => this.told.failed(detail));
    if (source instanceof Blob) {
      this.address = URL.createObjectURL(source);
      Object.assign(this.video, {src: this.address, loop: true});
    } else this.video.srcObject = source;
    await this.video.play();
    this.box.style.aspectRatio =
        `${this.video.videoWidth} / ${this.video.videoHeight}`;  // all of it is seen
    await tracker.start(this.video, {extended: true});
  }

  /**
   * @param {string} name
   * @param {boolean} seen
   */
  #know(name, seen) {
    this.#seen[seen ? 'add' : 'delete'](name);
    this.told.found([...this.#seen]);
  }

  close() {
    this.#ended = true;
    this.#tracker?.close();
    this.video.srcObject = null;
    this.video.removeAttribute('src');
    if (this.address) URL.revokeObjectURL(this.address);
    this.layers.models.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
  }
}

/** A QR code as an image: an SVG of the server is shown, never part of the page. */
class Code {
  /** @param {Studio.Vnode<{ svg: string }>} vnode */
  constructor({attrs}) {
    this.address = URL.createObjectURL(new Blob([attrs.svg], {type: 'image/svg+xml'}));
  }

  onremove() { URL.revokeObjectURL(this.address); }

  /** @param {Studio.Vnode<{ svg: string }>} _ */
  view(_) { return m('img.code', {src: this.address, alt: t('qr')}); }
}

export class Try {
  constructor() {
    /** @type {MediaStream | Blob | null} what the bundle is played on */
    this.source = null;
    /** @type {Player | null} */
    this.player = null;
    /** @type {string[]} */
    this.found = [];
    /** @type {Studio.Said | null} */
    this.failure = null;
    this.phone = state.project.phone;
  }

  onremove() { this.close(); }

  async camera() {
    try {
      this.open(await navigator.mediaDevices.getUserMedia(CAMERA));
    } catch (error) {
      this.failure = {
        text:
            t(error instanceof Error && error.name === 'NotAllowedError' ? 'cameraRefused' :
                                                                           'cameraMissing'),
        cure: t('cameraCure')
      };
    }
    m.redraw();
  }

  /** @param {MediaStream | Blob} source */
  open(source) {
    this.close();
    this.failure = null;
    this.source = source;
  }

  close() {
    this.player?.close();
    if (this.source instanceof MediaStream)
      this.source.getTracks().forEach((track) => track.stop());
    this.player = this.source = null;
    this.found = [];
  }

  /**
   * Another bake has another player, of the same source.
   * @param {HTMLElement} dom
   * @param {MediaStream | Blob} source
   */
  begin(dom, source) {
    /** @param {Studio.Wrong & { reason?: string }} error */
    const failed = (error) => {
      this.close();
      this.failure =
          said({code: error.code ?? 'gl', text: error.reason ?? error.message, cure: error.cure});
      m.redraw();
    };
    this.player?.close();
    this.player = new Player(dom, {
      found: (names) => {
        this.found = names;
        m.redraw();
      },
      failed
    });
    this.player.play(source).catch(failed);
  }

  async startPhone() {
    try {
      this.phone = await askJson('POST', 'phone', {});
    } catch (error) { tellError(error); }
    m.redraw();
  }

  async stopPhone() {
    await ask('DELETE', 'phone').catch(tellError);
    this.phone = null;
    m.redraw();
  }

  /** @param {MediaStream | Blob} source */
  playing(source) {
    return m(
        'div.playing', {key: state.baked, oncreate: ({dom}) => this.begin(dom, source)},
        m('video', {muted: true, playsinline: true, 'aria-hidden': 'true', tabindex: -1}),
        m('canvas.picture', {'aria-hidden': 'true'}),
        m('canvas.models', {role: 'img', 'aria-label': t('stage')}),
        m('p.hint', {role: 'status'},
          this.found.length ? t('seen', {names: this.found.join(', ')}) : t('showPicture')),
        tool(t('stop'), 'close', () => this.close(), {class: 'over'}));
  }

  phoneCard() {
    if (!this.phone)
      return m(
          'div.card.way', icon('try'), m('h2', t('onPhone')), m('p', t('onPhoneWords')),
          button(t('startPhone'), () => this.startPhone(), {kind: '.quiet'}));
    return m(
        'div.card.way', [m(Code, {key: this.phone.url, svg: this.phone.qr_svg})],
        m('h2', t('scan')), m('p', t('scanWords')),
        m('p.address',
          m('a', {href: this.phone.url, target: '_blank', rel: 'noopener'}, this.phone.url)),
        button(t('stopPhone'), () => this.stopPhone(), {kind: '.quiet.small'}));
  }

  view() {
    const next = m('a.button.primary', {href: '#/ship'}, m('span', t('toShip')), icon('next'));
    return m(
        'div.screen', m('div.top', head(t('try'), t('tryLead')), next),
        this.failure && finding({...this.failure, severity: 'error'}),
        m('div.ways', this.source ? [this.playing(this.source)] : [
          m('div.card.way', {key: 'camera'}, icon('camera'), m('h2', t('withCamera')),
            m('p', t('withCameraWords')),
            button(t('startCamera'), () => this.camera(), {kind: '.quiet'})),
          m('div.card.way', {key: 'film'}, icon('film'), m('h2', t('withFilm')),
            m('p', t('withFilmWords')),
            m('label.button.quiet', m('span', t('chooseFilm')), m('input.unseen', {
                type: 'file',
                accept: 'video/*',
                onchange: (event) => event.target.files?.[0] && this.open(event.target.files[0])
              }))),
          !('modarStatic' in globalThis) && m('div.wrap', {key: 'phone'}, this.phoneCard())
        ]));
  }
}
