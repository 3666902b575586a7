// @ts-check
// A visitor's questionnaire and the log of the visit, for trials: loaded where the page's address
// ends in ?survey. Answers stay on this device until the visitor saves them as a file.

/**
 * What app.js hands over, which has it loaded.
 * @typedef {{viewer: import('./modar-viewer.js').ModarViewer, foot: HTMLElement, title: string,
 *     adopt: typeof import('./viewer-parts.js').adopt,
 *     fetchJson: typeof import('./viewer-words.js').fetchJson,
 *     store: typeof import('./storage.js').store,
 *     stored: typeof import('./storage.js').stored}} Page
 *
 * @typedef {Record<'open' | 'how' | 'agree' | 'disagree' | 'save' | 'kept', string>
 *     & {statements: string[], questions: string[]}} Words
 * @typedef {{language: string, sus: (number | null)[], score: number | null, answers: string[]}}
 *     Answers
 */

const KEPT = 'modar-survey';
const STEPS = [1, 2, 3, 4, 5];
/** Milliseconds that a frame of the camera may take, as in the log of modar-play. */
const BUDGET_MS = 33.333;
/** Seconds and events that are logged: an hour, and more than a visitor sees. */
const MOST_LINES = 5000;
const STYLE = `
#survey fieldset { border: 0; padding: 0; margin: 0; }
#survey .steps { display: flex; flex-wrap: wrap; gap: .2rem 1rem; align-items: center; }
#survey .steps label { display: inline-flex; align-items: center; gap: .3rem; min-width: 2.75rem; min-height: 2.75rem; }
#survey textarea { width: 100%; box-sizing: border-box; font: inherit; }`;

/**
 * The System Usability Scale (Brooke, 1996): odd statements praise, even ones blame. null where one
 * has no answer.
 * @param {(number | null)[]} answers 1 to 5 each
 */
export function susScore(answers) {
  let sum = 0;
  for (const [i, answer] of answers.entries()) {
    if (answer === null) return null;
    sum += i % 2 === 0 ? answer - 1 : 5 - answer;
  }
  return 2.5 * sum;
}

const rounded = (/** @type {number} */ value) => Math.round(1000 * value) / 1000;

/** @param {number[]} values */
function quantiles(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const at = (/** @type {number} */ share) =>
      rounded(sorted[Math.ceil(share * sorted.length) - 1] ?? 0);
  return {median: at(0.5), p95: at(0.95), max: at(1)};
}

/** Lines of JSON with the members of the log of `modar-play --qos`, as far as a page knows them. */
export class VisitLog {
  /** @type {object[]} */
  #lines = [];
  /** @type {{reason: string, ms: number}[]} */
  #frames = [];
  #from = -1;
  /**
   * When each pattern was found or lost last.
   * @type {Map<string, number>}
   */
  #since = new Map();

  /** @param {object} head */
  constructor(head) { this.#lines.push({qos: {version: 1, ...head, budget_ms: BUDGET_MS}}); }

  /**
   * @param {'found' | 'lost'} event
   * @param {{name: string, time: number, reason?: string}} what
   */
  event(event, {name, time, reason}) {
    if (this.#from < 0) this.#from = time;
    const after = time - (this.#since.get(name) ?? this.#from);
    this.#since.set(name, time);
    this.#add({
      event,
      pattern: name,
      time_s: rounded(time),
      after_s: rounded(after),
      ...(event === 'lost' && {reason})
    });
  }

  /** @param {{reason: string, time: number, copyMs: number, stepMs: number}} frame */
  frame({reason, time, copyMs, stepMs}) {
    if (this.#from < 0) this.#from = time;
    this.#frames.push({reason, ms: copyMs + stepMs});
    if (time - this.#from < 1) return;
    const frames = this.#frames;
    /** @type {Record<string, number>} */
    const reasons = {};
    for (const each of frames) reasons[each.reason] = (reasons[each.reason] ?? 0) + 1;
    this.#add({
      second: {
        from_s: rounded(this.#from),
        frames: frames.length,
        visible: reasons.visible ?? 0,
        late: frames.filter(({ms}) => ms > BUDGET_MS).length,
        reasons,
        ms: {track: quantiles(frames.map(({ms}) => ms))}
      }
    });
    this.#frames = [];
    this.#from = time;
  }

  /** @param {object} line */
  #add(line) {
    if (this.#lines.length < MOST_LINES) this.#lines.push(line);
  }

  /** @param {object | null} survey */
  text(survey) {
    return [...this.#lines, ...(survey ? [{survey}] : [])]
        .map((line) => `${JSON.stringify(line)}\n`)
        .join('');
  }
}

/**
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Partial<HTMLElementTagNameMap[Tag]>} members
 * @param {(Node | string)[]} content
 */
function make(tag, members = {}, ...content) {
  const element = Object.assign(document.createElement(tag), members);
  element.append(...content);
  return element;
}

/** A button at the foot of the page, the questions that it opens, and the log that is saved. */
export class Survey {
  #words = /** @type {Words} */ (/** @type {unknown} */ (null));
  #back = '';
  #button = make('button', {id: 'survey-open', type: 'button', className: 'link'});
  #dialog = make('dialog', {id: 'survey', className: 'dialog'});
  #page;
  #log;

  /** @param {Page} page */
  constructor(page) {
    this.#page = page;
    const {viewer, foot, title, adopt} = page;
    adopt(document, STYLE);
    this.#log = new VisitLog({page: title, input: 'camera', device: navigator.userAgent});
    for (const type of /** @type {const} */ (['found', 'lost']))
      viewer.addEventListener(type, ({detail}) => this.#log.event(type, detail));
    viewer.addEventListener('frame', ({detail}) => this.#log.frame(detail));
    this.#button.addEventListener('click', () => this.#open());
    this.#dialog.setAttribute('aria-labelledby', 'survey-title');
    this.#dialog.addEventListener('change', () => this.#keep());
    document.body.append(this.#dialog);
    foot.append(this.#button);
  }

  /**
   * @param {string} language
   * @param {string} back the page's word for closing a dialog
   */
  async speak(language, back) {
    this.#words = await this.#page.fetchJson(`survey/${language}.json`);
    this.#back = back;
    this.#button.textContent = this.#words.open;
  }

  #open() {
    const {open, how, save, statements, questions} = this.#words;
    const form = make('form', {method: 'dialog'});
    const done = make('button', {type: 'button', textContent: save});
    done.addEventListener('click', () => this.#save());
    form.append(
        make('h2', {id: 'survey-title', textContent: open}), make('p', {textContent: how}),
        ...statements.map((text, i) => this.#scale(text, i)),
        ...questions.map(
            (text, i) => make(
                'p', {}, make('label', {htmlFor: `answer-${i}`, textContent: text}),
                make('textarea', {id: `answer-${i}`, name: `a${i}`, rows: 2}))),
        make('output', {id: 'survey-kept', className: 'small'}),
        make(
            'p', {className: 'row'}, done,
            make('button', {className: 'quiet', textContent: this.#back})));
    this.#dialog.replaceChildren(form);
    this.#fill(form);
    this.#dialog.showModal();
  }

  /**
   * @param {string} text
   * @param {number} number
   */
  #scale(text, number) {
    const {agree, disagree} = this.#words;
    const steps = STEPS.map(
        (step) => make(
            'label', {}, make('input', {type: 'radio', name: `s${number}`, value: `${step}`}),
            `${step}`));
    const ends = [disagree, agree].map((word) => make('span', {className: 'small'}, word));
    return make(
        'fieldset', {}, make('legend', {textContent: `${number + 1}. ${text}`}),
        make('div', {className: 'steps'}, ends[0], ...steps, ends[1]));
  }

  /** @param {HTMLFormElement} form */
  #fill(form) {
    const kept = this.#kept;
    if (!kept) return;
    kept.sus.forEach((value, i) => {
      const step = form.querySelector(`[name=s${i}][value="${value}"]`);
      if (step) /** @type {HTMLInputElement} */
        (step).checked = true;
    });
    kept.answers.forEach((text, i) => {
      const field = form.querySelector(`[name=a${i}]`);
      if (field) /** @type {HTMLTextAreaElement} */
        (field).value = text;
    });
  }

  /** @returns {Answers | null} */
  get #kept() { return JSON.parse(this.#page.stored(KEPT) || 'null'); }

  #keep() {
    const form = /** @type {HTMLFormElement} */ (this.#dialog.querySelector('form'));
    const values = new FormData(form);
    const sus = this.#words.statements.map((_, i) => Number(values.get(`s${i}`)) || null);
    const answers = this.#words.questions.map((_, i) => String(values.get(`a${i}`) ?? ''));
    const {lang: language} = document.documentElement;
    this.#page.store(KEPT, JSON.stringify({language, sus, score: susScore(sus), answers}));
    const kept = this.#dialog.querySelector('#survey-kept');
    if (kept) kept.textContent = this.#words.kept;
  }

  #save() {
    const file = new Blob([this.#log.text(this.#kept)], {type: 'application/jsonl'});
    const link = make('a', {href: URL.createObjectURL(file), download: 'modar-visit.jsonl'});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}
