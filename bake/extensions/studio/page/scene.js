// Step 3: models on a picture, moved by drags or numbers, and their texts.
import {boxOf, halfOf, isInMm, placed, rotation, multiply, turning, turnOf, wrapped} from './placing.js';
import {button, finding, head, icon, LengthField, name, NumberField, tool} from './parts.js';
import {rail} from './rail.js';
import {EYES, HANDLES, Stage} from './stage.js';
import {addScene, deleteScene, modelOf, scenesOf, bundleBytes, setScene, state, tellError} from './state.js';
import {surfaceOf} from './surface.js';
import {ModelThumb} from './thumbs.js';
import {languageName, length, number, said, t} from './words.js';

const m = window.m;
/** What the bake takes where a scene says nothing: the model's own axis. */
const AXES = ['y', 'z', 'x', '-y', '-z', '-x'];

/** Models that a picture on which nothing stands offers as buttons; a list has them all. */
const MOST_OFFERS = 6;

const rounded = (value, digits = 4) => Number(value.toPrecision(digits));
const degrees = (value) => Number(wrapped(value).toFixed(1)) + 0;

/** Keys of modar.toml that a change of a handle sets. */
function valuesOf(scene, change, unit) {
  if (change.move) {
    const factor = isInMm(scene, unit) ? unit : 0.5;
    return {
      offset: scene.offset.map(
          (value, i) =>
              Number((value + change.move[i] * factor).toFixed(factor === unit ? 1 : 4)) + 0)
    };
  }
  if (change.size) return sizeValues(scene, scene.size.kind, scene.size.value * change.size);
  return turnValues(turnOf(multiply(rotation(...change.turn), turning(scene.turn))));
}

const turnValues = (turn) => {
  const [x, y, z] = turn.map(degrees);
  return {turn: x || y ? [x, y, z] : z || null};
};

const sizeValues = (scene, kind, value) =>
    ({[kind]: kind === 'scale' ? rounded(value) : `${rounded(value)}mm`});

/** Attributes: pattern. */
export class Scene {
  oninit() {
    this.selected = null;
    this.tilting = false;
    this.language = state.project.languages[0] ?? document.documentElement.lang;
    this.picture = null;
    this.loaded = -1;
    this.failure = null;
  }

  oncreate({dom, attrs}) {
    this.attrs = attrs;
    this.stage = new Stage(dom.querySelector('.stage3d'), {
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

  onupdate({attrs}) {
    this.attrs = attrs;
    this.update();
  }

  onremove() { this.stage.close(); }

  /** Updates the stage from the project. */
  update() {
    if (!this.picture) return;
    this.stage.show({
      pattern: this.attrs.pattern,
      scenes: this.scenes(),
      selected: this.selected,
      surface: this.surface,
      tilting: this.tilting
    });
    const {bundle: baked} = state.project;
    if (!baked.baked || this.loaded === state.baked || baked.stale && this.loaded >= 0) return;
    this.loaded = state.baked;
    const scenes = baked.scenes ?? state.project.scenes.filter(({model}) => model);
    bundleBytes().then((bytes) => this.stage.load(bytes, scenes)).catch(tellError);
  }

  get surface() { return surfaceOf(this.attrs.pattern, this.picture); }

  get unit() { return this.picture ? this.surface.unit : null; }

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

  select(key) {
    this.selected = key;
    m.redraw();
  }

  wordsOf(change) {
    const {unit} = this;
    const far = (value) =>
        (unit ? length(value * unit) : `${number(Number((50 * value).toFixed(1)))} %`);
    if (!change) return '';
    if (change.size) return `${number(Math.round(100 * change.size))} %`;
    if (change.turn) return `${number(Math.round(change.turn[1]))}°`;
    return change.move[2] ? far(change.move[2]) : `${far(change.move[0])} · ${far(change.move[1])}`;
  }

  // ---- the stage ----

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
                    icon(kind.startsWith('tilt') ? 'turn' : kind))),
          m('output.tip', {hidden: true})),
        m('div.views.over', {role: 'group', 'aria-label': t('views')},
          Object.keys(EYES).map(
              (eye) =>
                  button(t(`view.${eye}`), () => this.stage.look(eye), {kind: '.quiet.small'}))),
        !scenes.length && m('p.hint', t('standFirst')), this.waiting(scenes));
  }

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

  offsetFields(scene) {
    const inMm = isInMm(scene, this.unit);
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

  sizeField(scene) {
    const {low, high} = boxOf(scene.matrix, scene.half);
    if (!this.unit) {
      return m(NumberField, {
        id: 'size',
        label: t('sizeInPictures'),
        value: 100 * scene.size.value,
        unit: '%',
        least: 0.1,
        onvalue: (value) => setScene(scene, sizeValues(scene, 'scale', value / 100))
      });
    }
    const kind = scene.size.kind === 'width' ? 'width' : 'height';
    const now = scene.size.kind === kind ? scene.size.value : (high[2] - low[2]) * this.unit;
    return m(LengthField, {
      id: 'size',
      label: t(kind === 'width' ? 'modelWidth' : 'modelHeight'),
      value: now,
      least: 0.1,
      onvalue: (mm) => setScene(scene, sizeValues(scene, kind, mm))
    });
  }

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
   * The axis that is up after one more press: all six in turn, first the one that files mean most
   * often. null: the found one.
   */
  nextSide(scene) {
    const found = scene.asset?.up ?? AXES[0];
    const sides = [found, ...AXES.filter((axis) => axis !== found)];
    const next = sides[(sides.indexOf(scene.up ?? found) + 1) % sides.length];
    return next === found ? null : next;
  }

  fields(scene) {
    const tipped = scene.up && scene.up !== scene.asset?.up;
    const leans = tipped || scene.turn[0] !== 0 || scene.turn[1] !== 0;
    return [
      m('div.fields', this.sizeField(scene), this.turnField(scene, 2)),
      m('div.fields.three', this.offsetFields(scene)),
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

  words(scene) {
    const languages = [...new Set([
      ...state.project.languages, document.documentElement.lang, 'en', 'de', 'fr', 'es', 'it', 'nl',
      'pl', 'el'
    ])];
    const area = (kind, label, rows) =>
        m('div.field', m('label', { for: kind
          }, label), m('textarea', {
            id: kind,
            rows,
            dir: 'auto',
            lang: this.language,
            value: scene[`${kind}s`][this.language] ?? '',
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

  models(scenes) {
    const all = state.project.models;
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
            scene && this.words(scene)),
          m('div.foot',
            scenes.length > 0 &&
                m('a.button.primary', {href: '#/try'}, m('span', t('toTry')), icon('next')))));
  }
}
