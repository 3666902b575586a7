// @ts-check
// Step 3: models on a picture, moved by drags or numbers, and their texts.
import {boxOf, halfOf, isInMm, placed, rotation, multiply, turning, turnOf, wrapped} from './placing.js';
import {button, choice, finding, head, icon, LengthField, name, NumberField, part, tool} from './parts.js';
import {rail} from './rail.js';
import {EYES, HANDLES, Stage} from './stage.js';
import {addScene, deleteScene, modelOf, scenesOf, bundleBytes, setModel, setScene, state, tellError} from './state.js';
import {surfaceOf} from './surface.js';
import {ModelThumb} from './thumbs.js';
import {languageName, length, number, said, t} from './words.js';

const m = window.m;
/** @typedef {{ pattern: Studio.Pattern }} SceneAttributes */
/** @typedef {import('./parts.js').Shape} Shape */
/** @typedef {Studio.Wrong & { reason?: string }} Broken */
/**
 * What the bake takes where a scene says nothing: the model's own axis.
 * @type {Studio.Axis[]}
 */
const AXES = ['y', 'z', 'x', '-y', '-z', '-x'];

/** Models that a picture on which nothing stands offers as buttons; a list has them all. */
const MOST_OFFERS = 6;

/** @param {number} value */
const rounded = (value, digits = 4) => Number(value.toPrecision(digits));
/** @param {number} value */
const degrees = (value) => Number(wrapped(value).toFixed(1)) + 0;

/**
 * Keys of modar.toml that a change of a handle sets.
 * @param {Studio.Scene} scene
 * @param {Studio.Change} change
 * @param {number | null} unit
 */
function valuesOf(scene, change, unit) {
  const {move, turn, size} = change;
  if (move) {
    const factor = isInMm(scene, unit) ? unit ?? 1 : 0.5;
    return {
      offset: scene.offset.map(
          (value, i) => Number((value + move[i] * factor).toFixed(factor === unit ? 1 : 4)) + 0)
    };
  }
  if (size) return sizeValues(scene.size.kind, scene.size.value * size);
  return turn ? turnValues(turnOf(multiply(rotation(...turn), turning(scene.turn)))) : {};
}

/** @param {Studio.Point} turn */
const turnValues = (turn) => {
  const [x, y, z] = turn.map(degrees);
  return {turn: x || y ? [x, y, z] : z || null};
};

/** @type {(kind: Studio.Scene['size']['kind'], value: number) => Studio.Values} */
const sizeValues = (kind, value) =>
    ({[kind]: kind === 'scale' ? rounded(value) : `${rounded(value)}mm`});

export class Scene {
  /** @param {Studio.Vnode<SceneAttributes>} vnode */
  constructor({attrs}) {
    this.attrs = attrs;
    this.name = attrs.pattern.name;
    /** @type {Stage | null} from oncreate() on */
    this.stage = null;
    /** @type {string | null} */
    this.selected = null;
    this.tilting = false;
    this.language = state.project.languages[0] ?? document.documentElement.lang;
    /** @type {Studio.Sized | null} */
    this.picture = null;
    this.loaded = -1;
    /** @type {Broken | null} */
    this.failure = null;
  }

  /** @param {Studio.Vnode<SceneAttributes>} vnode */
  oncreate({dom, attrs}) {
    this.attrs = attrs;
    this.stage = new Stage(part(dom, '.stage3d', HTMLElement), {
      select: (scene) => this.select(scene.key),
      change: (scene, change) => setScene(scene, (now) => valuesOf(now, change, this.unit)),
      words: (change) => this.wordsOf(change),
      failed: (error) => {
        this.failure = error;
        m.redraw();
      },
    });
    this.update();
  }

  /** @param {Studio.Vnode<SceneAttributes>} vnode */
  onupdate({attrs}) {
    this.attrs = attrs;
    this.update();
  }

  onremove() { this.stage?.close(); }

  /** Updates the stage from the project. */
  update() {
    const {stage, surface} = this;
    if (!stage || !surface) return;
    stage.show({
      pattern: this.attrs.pattern,
      scenes: this.scenes(),
      selected: this.selected,
      surface,
      tilting: this.tilting
    });
    const {bundle: baked} = state.project;
    if (!baked.baked || this.loaded === state.baked || baked.stale && this.loaded >= 0) return;
    this.loaded = state.baked;
    const scenes = baked.scenes ?? state.project.scenes.filter(({model}) => model);
    bundleBytes().then((bytes) => stage.load(bytes, scenes)).catch(tellError);
  }

  get surface() { return this.picture && surfaceOf(this.attrs.pattern, this.picture); }

  get unit() { return this.surface?.unit ?? null; }

  /** @returns {Studio.Placed[]} */
  scenes() {
    return scenesOf(this.attrs.pattern.name).map((scene, i) => {
      const asset = modelOf(scene.model);
      return {
        ...scene,
        key: `${i} ${scene.model}`,
        asset,
        half: halfOf(asset),
        matrix: placed(scene, asset, this.unit).matrix
      };
    });
  }

  /** @param {string | null} key */
  select(key) {
    this.selected = key;
    m.redraw();
  }

  /** @param {Studio.Change | null} change */
  wordsOf(change) {
    const {unit} = this;
    /** @param {number} value */
    const far = (value) =>
        (unit ? length(value * unit) : `${number(Number((50 * value).toFixed(1)))} %`);
    if (!change) return '';
    if (change.size) return `${number(Math.round(100 * change.size))} %`;
    if (change.turn) return `${number(Math.round(change.turn[1]))}°`;
    const [x, y, lift] = change.move ?? [0, 0, 0];
    return lift ? far(lift) : `${far(x)} · ${far(y)}`;
  }

  // ---- the stage ----

  /** @param {Studio.Placed[]} scenes */
  stageView(scenes) {
    return m(
        'section.stage', {'aria-label': t('stage')},
        m('div.stage3d', {role: 'application', tabindex: 0, 'aria-label': t('stageHelp')},
          m('img.ground', {
            src: `api/picture?pattern=${encodeURIComponent(this.name)}&v=${
                encodeURIComponent(state.project.revision)}`,
            alt: '',
            draggable: false,
            onload: (event) => {
              this.picture = {width: event.target.naturalWidth, height: event.target.naturalHeight};
            }
          }),
          m('canvas.body', {hidden: true, 'aria-hidden': 'true'}),
          m('div.layers', {'aria-hidden': 'true'}),
          m('svg.guides', {'aria-hidden': 'true'},
            ['box', 'snap', 'ring', 'stem', 'tilt0', 'tilt1'].map(
                (line) => m('path', {key: line, 'data-line': line}))),
          HANDLES.map(
              (kind) =>
                  m('button.handle', {
                    key: kind,
                    type: 'button',
                    hidden: true,
                    'data-handle': kind,
                    title: t(`handle.${kind}`),
                    'aria-label': t(`handle.${kind}`),
                    class: kind
                  },
                    icon(kind === 'tilt0' || kind === 'tilt1' ? 'turn' : kind))),
          m('output.tip', {hidden: true})),
        m('div.views.over', {role: 'group', 'aria-label': t('views')},
          /** @type {(keyof typeof EYES)[]} */
          (Object.keys(EYES)).map((eye) => button(t(`view.${eye}`), () => this.stage?.look(eye), {
                                    kind: '.quiet.small'
                                  }))),
        !scenes.length && m('p.hint', t('standFirst')), this.waiting(scenes));
  }

  /** @param {Studio.Placed[]} scenes */
  waiting(scenes) {
    if (this.failure)
      return m('div.hint', finding({
                 ...said({
                   code: 'gl',
                   text: this.failure.reason ?? this.failure.message,
                   cure: this.failure.cure
                 }),
                 severity: 'error'
               }));
    if (state.failure?.kind === 'bake')
      return m('div.hint', finding({...said(state.failure), severity: 'error'}));
    return scenes.length > 0 && !state.project.bundle.baked &&
        m('p.hint', {'aria-busy': 'true'}, t('preparingModel'));
  }

  // ---- numbers ----

  /** @param {Studio.Placed} scene */
  offsetFields(scene) {
    const inMm = isInMm(scene, this.unit);
    /** @type {(axis: number) => (value: number) => unknown} */
    const set = (axis) => (value) => setScene(
        scene,
        (now) =>
            ({offset: now.offset.map((old, i) => (i === axis ? Number(value.toFixed(4)) : old))}));
    return ['right', 'up', 'lift'].map(
        (key, axis) =>
            (inMm ? m(LengthField, {
              key,
              id: `offset-${key}`,
              label: t(`offset.${key}`),
              value: scene.offset[axis],
              onvalue: set(axis),
              choose: axis === 0
            }) :
                    m(NumberField, {
                      key,
                      id: `offset-${key}`,
                      label: t(`offset.${key}`),
                      value: 100 * scene.offset[axis],
                      unit: '%',
                      onvalue: (value) => set(axis)(value / 100)
                    })));
  }

  /** @param {Studio.Placed} scene */
  sizeField(scene) {
    const {low, high} = boxOf(scene.matrix, scene.half);
    if (!this.unit) {
      return m(NumberField, {
        id: 'size',
        label: t('sizeInPictures'),
        value: 100 * scene.size.value,
        unit: '%',
        least: 0.1,
        onvalue: (value) => setScene(scene, sizeValues('scale', value / 100))
      });
    }
    const kind = scene.size.kind === 'width' ? 'width' : 'height';
    const now = scene.size.kind === kind ? scene.size.value : (high[2] - low[2]) * this.unit;
    return m(LengthField, {
      id: 'size',
      label: t(kind === 'width' ? 'modelWidth' : 'modelHeight'),
      value: now,
      least: 0.1,
      onvalue: (mm) => setScene(scene, sizeValues(kind, mm))
    });
  }

  /**
   * @param {Studio.Placed} scene
   * @param {number} axis
   */
  turnField(scene, axis) {
    const key = ['tiltX', 'tiltY', 'turn'][axis];
    return m(NumberField, {
      key,
      id: `turn-${axis}`,
      label: t(key),
      value: scene.turn[axis],
      unit: '°',
      digits: 1,
      onvalue: (value) =>
          setScene(scene, (now) => turnValues(now.turn.map((old, i) => (i === axis ? value : old))))
    });
  }

  /** @param {Studio.Placed} scene */
  upField(scene) {
    const found = scene.asset?.up;
    return m(
        'div.field',
        m('label',
          { for: 'up'
          },
          t('up')),
        m('select',
          {id: 'up', onchange: (event) => setScene(scene, {up: event.target.value || null})},
          m('option', {value: '', selected: !scene.up},
            found ? t('upFound', {axis: found.toUpperCase()}) : t('upAuto')),
          AXES.map(
              (axis) =>
                  m('option', {value: axis, selected: scene.up === axis}, axis.toUpperCase()))));
  }

  /**
   * Which of the model's animations plays; the first one, unless another is chosen.
   * @param {Studio.Placed} scene
   */
  clipField(scene) {
    const clips = scene.asset?.clips ?? [];
    if (!clips.length) return null;
    const chosen = scene.clip ?? clips[0];
    return m(
        'div.field',
        m('label',
          { for: 'clip'
          },
          t('clip')),
        m('select', {
          id: 'clip',
          onchange: (event) =>
              setScene(scene, {clip: event.target.value === clips[0] ? null : event.target.value})
        },
          clips.map((clip) => m('option', {value: clip, selected: clip === chosen}, clip)),
          m('option', {value: 'none', selected: chosen === 'none'}, t('clipNone'))));
  }

  /**
   * The axis that is up after one more press: all six in turn, first the one that files mean most
   * often. null: the found one.
   * @param {Studio.Placed} scene
   */
  nextSide(scene) {
    const found = scene.asset?.up ?? AXES[0];
    const sides = [found, ...AXES.filter((axis) => axis !== found)];
    const next = sides[(sides.indexOf(scene.up ?? found) + 1) % sides.length];
    return next === found ? null : next;
  }

  /** @param {Studio.Placed} scene */
  fields(scene) {
    const tipped = scene.up && scene.up !== scene.asset?.up;
    const leans = tipped || scene.turn[0] !== 0 || scene.turn[1] !== 0;
    return [
      m('div.fields', this.sizeField(scene), this.turnField(scene, 2)),
      m('div.fields.three', this.offsetFields(scene)), this.clipField(scene),
      m('div.row.three',
        button(
            t('tipOver'), () => setScene(scene, {up: this.nextSide(scene)}),
            {kind: '.quiet.small', shape: 'turn'}),
        button(
            t('snapUpright'),
            () =>
                setScene(scene, {...turnValues([0, 0, scene.turn[2]]), ...(tipped && {up: null})}),
            {kind: '.quiet.small', shape: 'upright', disabled: !leans}),
        button(t('toMiddle'), () => setScene(scene, {offset: null}), {
          kind: '.quiet.small',
          shape: 'move',
          disabled: scene.offset.every((each) => each === 0)
        })),
      m('details', {
        ontoggle: (event) => {
          this.tilting = event.target.open;
        }
      },
        m('summary', t('tilt')),
        m('div.fields.three', this.turnField(scene, 0), this.turnField(scene, 1),
          this.upField(scene)))
    ];
  }

  /**
   * The model before and after its repair: the stage draws the one that is chosen.
   * @param {Studio.Placed} scene
   */
  repair({asset}) {
    if (!asset) return null;
    const {settings} = state.project;
    /** @param {string} key */
    const isSet = (key) => (asset.settings[key] ?? settings[key]) === 'true';
    /** @type {(key: string, wanted: boolean) => Studio.Values} */
    const value = (key, wanted) => ({[key]: wanted === (settings[key] === 'true') ? null : wanted});
    const now = isSet('repair-support') ? 'support' : isSet('repair') ? 'after' : 'before';
    const done = Object.entries(asset.repair ?? {}).filter(([, {count}]) => count > 0);
    return m(
        'details.repair', m('summary', t('repair')),
        choice(
            'repair', t('repairShown'),
            [
              ['before', t('repairBefore')], ['after', t('repairAfter')],
              ['support', t('repairSupport')]
            ],
            now, (chosen) => setModel(asset.name, {
                   ...value('repair', chosen === 'after'),
                   ...value('repair-support', chosen === 'support')
                 })),
        m('p.repaired',
          now !== 'before' && asset.repair &&
              (done.map(([kind, {count}]) => `${t(`repair.${kind}`)}: ${number(count)}`)
                   .join(' · ') ||
               t('repairNothing'))));
  }

  /** @param {Studio.Placed} scene */
  words(scene) {
    const languages = [...new Set([
      ...state.project.languages, document.documentElement.lang, 'en', 'de', 'fr', 'es', 'it', 'nl',
      'pl', 'el'
    ])];
    /** @type {(kind: 'text' | 'alt', label: string, rows: number) => Studio.Drawn} */
    const area = (kind, label, rows) =>
        m('div.field', m('label', { for: kind
          }, label), m('textarea', {
            id: kind,
            rows,
            dir: 'auto',
            lang: this.language,
            value: scene[kind === 'text' ? 'texts' : 'alts'][this.language] ?? '',
            onchange: (event) =>
                setScene(scene, {[`${kind}.${this.language}`]: event.target.value || null})
          }));
    return m(
        'details', m('summary', t('words')),
        m('div.field',
          m('label',
            { for: 'words-language'
            },
            t('wordsLanguage')),
          m('select', {
            id: 'words-language',
            onchange: (event) => {
              this.language = event.target.value;
            }
          },
            languages.map(
                (tag) =>
                    m('option', {value: tag, selected: tag === this.language}, languageName(tag),
                      scene.texts[tag] || scene.alts[tag] ? ' ✓' : '')))),
        area('text', t('text'), 3), area('alt', t('alt'), 2));
  }

  // ---- the panel ----

  /** @param {Studio.Placed[]} scenes */
  models(scenes) {
    const all = state.project.models;
    /** @param {string} chosen */
    const add = (chosen) => addScene(this.name, chosen).then(() => {
      const now = this.scenes();
      this.select(now[now.length - 1]?.key ?? null);
    });
    return m(
        'section', m('h2', t('onPicture')),
        m('ul.standing',
          scenes.map(
              (scene) =>
                  m('li', {key: scene.key, class: scene.key === this.selected ? 'chosen' : ''},
                    m('button.plain', {
                      type: 'button',
                      'aria-pressed': String(scene.key === this.selected),
                      onclick: () => this.select(scene.key)
                    },
                      m(ModelThumb, {model: scene.model, little: true}),
                      name(scene.name || scene.model)),
                    tool(t('takeOff', {name: scene.model}), 'trash', () => deleteScene(scene))))),
        !scenes.length &&
            m('div.offers',
              all.slice(0, MOST_OFFERS)
                  .map((model) => button(t('standOn', {name: model.name}), () => add(model.name), {
                         key: model.name,
                         kind: all.length > 1 ? '.quiet' : '.primary',
                         shape: 'add'
                       }))),
        (all.length > MOST_OFFERS || scenes.length > 0) &&
            m('div.field.add',
              m('label.unseen',
                { for: 'add'
                },
                t('addModel')),
              m('select', {
                id: 'add',
                value: '',
                onchange: (event) => {
                  if (event.target.value) add(event.target.value);
                }
              },
                m('option', {value: ''}, t('addModel')),
                all.map((model) => m('option', {value: model.name}, model.name)))));
  }

  /** @param {Studio.Vnode<SceneAttributes>} vnode */
  view({attrs}) {
    this.attrs = attrs;
    this.name = attrs.pattern.name;
    const scenes = this.scenes();
    if (!scenes.some(({key}) => key === this.selected)) this.selected = scenes[0]?.key ?? null;
    const scene = scenes.find(({key}) => key === this.selected);
    return m(
        'div.work', rail('scene', attrs.pattern), this.stageView(scenes),
        m('aside.panel',
          m('div.fill', head(name(attrs.pattern.name)), this.models(scenes),
            scene && m('section', m('h2.unseen', t('place')), this.fields(scene)),
            scene && this.repair(scene), scene && this.words(scene)),
          m('div.foot',
            scenes.length > 0 &&
                m('a.button.primary', {href: '#/try'}, m('span', t('toTry')), icon('next')))));
  }
}
