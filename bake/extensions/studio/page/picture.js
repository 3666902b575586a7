// @ts-check
// Step 2: where the picture is in the photo, how large it is in the world, and how well a phone
// will know it.
import {ask, askJson, Newest, thumb} from './api.js';
import {Corners} from './corners.js';
import {toHundredths, unsure} from './files.js';
import {button, choice, finding, grade, head, icon, LengthField, name, NumberField, part, tool} from './parts.js';
import {rail} from './rail.js';
import {arcOf, alongOf, sideName, widthOf} from './surface.js';
import {addScene, deleteAsset, isGone, loadRivals, loadScore, patternOf, setPattern, state, tellError} from './state.js';
import {number, said, t} from './words.js';

const m = window.m;
/**
 * The photo on the stage and the preview, at rest and while a corner is dragged: longer side,
 * pixels. The last trades sharpness for speed.
 */
const STAGE_PX = 2000;
const PREVIEW_PX = [360, 224];
/** @typedef {'a4' | 'a5' | 'postcard'} Paper */
/** @type {Record<Paper, Studio.Point>} millimetres, the shorter side first */
const PAPERS = {
  a4: [210, 297],
  a5: [148, 210],
  postcard: [105, 148]
};
const SHEETS = /** @type {Paper[]} */ (Object.keys(PAPERS));
/** @type {Studio.Side[]} */
const SIDES = ['right', 'left', 'top', 'bottom', 'back'];
/** @type {[Studio.Kind, import('./parts.js').Shape][]} */
const KINDS = [['flat', 'flat'], ['cylinder', 'label'], ['cone', 'cup'], ['box', 'box']];

/**
 * Milliseconds on the screen until its picture is compared with the others, which takes some
 * seconds of all processors.
 */
const RIVALS_AFTER_MS = 1500;

/** @typedef {'top' | 'bottom' | 'arc' | 'along' | 'width' | 'height' | 'depth'} Length */
/**
 * A shape so far. Its top and bottom are diameters; sides has the files of a box.
 * @typedef {Partial<Record<Length, number | null>> & { sides?: Studio.Pattern['sides'] }} Typed
 */

/** @type {(a: number, b: number) => boolean} */
const near = (a, b) => Math.abs(a - b) < 0.6;  // millimetres

/**
 * What surface.js takes for diameters; null: they are not all told.
 * @param {Studio.Kind} kind
 * @param {Typed} shape
 */
function diameters(kind, {top, bottom}) {
  if (!top || kind === 'cone' && !bottom) return null;
  return kind === 'cone' ? {top_mm: top, bottom_mm: bottom} : {top_mm: top};
}

/** @type {Map<string, Studio.Point | null>} upright sizes of photos by file */
const photoSizes = new Map();

// ---- shown at once ----

/**
 * @typedef {Studio.Vnode<{ pattern: Studio.Pattern, score: Studio.Score | null,
 *     handle: (preview: Preview) => void }>} PreviewVnode
 */

/** The picture as the phone will know it, made anew while a corner is dragged. */
class Preview {
  /** @param {PreviewVnode} vnode */
  constructor({attrs}) {
    this.newest = new Newest((wanted) => this.fetch(wanted));
    /** @type {Studio.Point | null} */
    this.size = null;
    this.attrs = attrs;
    this.dom = document.body;  // until oncreate()
    attrs.handle(this);
  }

  /** @param {PreviewVnode} vnode */
  oncreate({dom, attrs}) {
    this.dom = dom;
    this.show(attrs.pattern.corners);
  }

  /** @param {PreviewVnode} vnode */
  onupdate({attrs}) {
    /** @param {Studio.Pattern} pattern */
    const lookOf = ({corners, width_mm: width, height_mm: height}) =>
        JSON.stringify([corners, width, height]);
    const changed = lookOf(this.attrs.pattern) !== lookOf(attrs.pattern);
    this.attrs = attrs;
    if (changed) this.show(attrs.pattern.corners);
  }

  /**
   * moving: earlier knowledge of the picture no longer holds.
   * @param {Studio.Point[] | null} corners
   */
  show(corners, moving = false) {
    this.dom.classList.toggle('moving', moving);
    this.newest.ask({corners, size: PREVIEW_PX[moving ? 1 : 0]});
  }

  /** @param {{ corners: Studio.Point[] | null, size: number }} wanted */
  async fetch({corners, size}) {
    const {pattern} = this.attrs;
    const began = performance.now();
    try {
      const sides = {
        ...(pattern.width_mm && {width_mm: pattern.width_mm}),
        ...(pattern.height_mm && {height_mm: pattern.height_mm})
      };
      const answer = await (
          corners ? ask('POST', 'rectify', {file: pattern.file, corners, ...sides, size}) :
                    fetch(thumb(pattern.file, size)));
      const image = await createImageBitmap(await answer.blob());
      const canvas = part(this.dom, 'canvas', HTMLCanvasElement);
      Object.assign(canvas, {width: image.width, height: image.height});
      canvas.getContext('2d')?.drawImage(image, 0, 0);
      Object.assign(
          canvas.dataset,
          {shown: JSON.stringify(corners), ms: String(Math.round(performance.now() - began))});
      this.size = [image.width, image.height];
      image.close();
      this.dom.classList.remove('impossible');
    } catch (error) {
      if (isGone(error)) tellError(error);
      this.dom.classList.add(
          'impossible');  // corners that are no quadrilateral: the last picture stays, pale
    }
  }

  /** @param {PreviewVnode} vnode */
  view({attrs: {pattern, score}}) {
    const most = score ? Math.max(score.width, score.height) : 0;
    return m(
        'div.preview', m('canvas', {role: 'img', 'aria-label': t('preview', {name: pattern.name})}),
        score &&
            m('svg', {
              viewBox: `0 0 ${score.width} ${score.height}`,
              preserveAspectRatio: 'none',
              'aria-hidden': 'true'
            },
              score.features.map(([x, y, held], i) => m('circle', {
                                   key: i,
                                   cx: x,
                                   cy: y,
                                   r: (0.004 + 0.008 * (held / score.views)) * most,
                                   class: 2 * held >= score.views ? 'held' : 'weak'
                                 }))));
  }
}

// ---- how good it is ----

/** @param {number} cm */
const distance = (cm) =>
    (Math.round(cm) >= 100 ? `${number(Number((cm / 100).toFixed(1)))} m` :
                             `${number(Number(cm.toFixed(cm < 10 ? 1 : 0)))} cm`);

/**
 * @param {Studio.Score} score
 * @param {number | null} width
 */
function reach({range_cm: known, range_widths: widths}, width) {
  const range = known ?? (width && widths?.map((each) => (each * width) / 10));
  if (range) return t('range', {near: distance(range[0]), far: distance(range[1])});
  return widths ?
      t('rangeWidths', {near: Number(widths[0].toFixed(1)), far: Number(widths[1].toFixed(1))}) :
      '';
}

/**
 * The last verdict of each pattern: it stays while the next one is made, so that nothing moves
 * under a finger.
 * @type {Map<string, Studio.Score>}
 */
const verdicts = new Map();

/** @param {Studio.Pattern} pattern */
function verdict(pattern) {
  const score = state.scores.get(pattern.name);
  if (!score) loadScore(pattern.name);
  if (score?.failed) return null;
  if (score && !score.pending) verdicts.set(pattern.name, score);
  const known = verdicts.get(pattern.name);
  return m(
      'div.verdict', known && m('p', grade(known.grade), m('b', t(`grade.${known.grade}`))),
      known && known === score ? m('p.small', reach(known, widthOf(pattern))) :
                                 m('p.small', {'aria-busy': 'true'}, t('judging')));
}

/** @param {Studio.Pattern} pattern */
function advice(pattern) {
  const score = state.scores.get(pattern.name);
  const some = score && !score.pending && !score.failed ? score.advice : [];
  const rivals = state.rivals.get(pattern.name);
  return m(
      'div.advice', {'aria-live': 'polite'},
      rivals?.found?.map(
          ({pattern: other, times, views}) => finding(
              {text: t('rival', {name: other, times, views})},
              m('p',
                m('a', {href: `#/picture/${encodeURIComponent(other)}`},
                  t('rivalSee', {name: other}))))),
      rivals?.pending && m('p.small', t('comparing')),
      some.filter(({text}) => text)
          .map(({id}) => finding({text: t(`advice.${id}`), severity: 'note'})));
}

// ---- the screen ----

/** @typedef {Studio.Vnode<{ pattern: Studio.Pattern }>} PictureVnode */

/** Incomplete choices are kept here: a paper, a shape without its sizes. */
export class Picture {
  /** @param {PictureVnode} vnode */
  constructor({attrs}) {
    this.timer = 0;
    this.compare(attrs.pattern);
    /** @type {string | null} */
    this.paper = null;
    /** @type {Studio.Kind | null} */
    this.kind = null;
    /** @type {Typed} */
    this.shape = {};
    this.features = true;
    this.naming = false;
    /** @type {Preview | null} */
    this.preview = null;
  }

  /** @param {PictureVnode} vnode */
  onupdate({attrs}) { this.compare(attrs.pattern); }

  onremove() { clearTimeout(this.timer); }

  /** @param {Studio.Pattern} pattern */
  compare({name: pattern}) {
    if (this.timer || state.rivals.has(pattern)) return;
    this.timer = setTimeout(() => {
      this.timer = 0;
      loadRivals(pattern);
    }, RIVALS_AFTER_MS);
  }

  /**
   * The width and height of a sheet in the picture's orientation.
   * @param {Paper} paper
   */
  sheet(paper) {
    const [short, long] = PAPERS[paper];
    const [width, height] = this.preview?.size ?? [1, 1];
    return width > height ? [long, short] : [short, long];
  }

  /** @param {Studio.Pattern} pattern */
  paperOf({width_mm: width, height_mm: height, corners}) {
    if (!width) return 'later';
    return SHEETS.find(
               (paper) => [PAPERS[paper], [...PAPERS[paper]].reverse()].some(
                   ([w, h]) => near(w, width) && (height ? near(h, height) : !corners))) ??
        'other';
  }

  /**
   * @param {Studio.Pattern} pattern
   * @param {string} paper
   */
  choosePaper(pattern, paper) {
    this.paper = paper === 'other' ? paper : null;
    if (paper === 'later')
      setPattern(
          pattern.name,
          {...(pattern.width_mm && {width: null}), ...(pattern.height_mm && {height: null})});
    const chosen = SHEETS.find((each) => each === paper);
    if (!chosen) return;
    const [width, height] = this.sheet(chosen);
    setPattern(pattern.name, {
      width: `${width}mm`,
      ...(pattern.corners && {height: `${height}mm`})
    });  // a scan has its own proportions
  }

  /** @param {Studio.Pattern} pattern */
  sizes(pattern) {
    const paper = this.paper ?? this.paperOf(pattern);
    /** @type {(key: string) => (mm: number | null) => unknown} */
    const set = (key) => (mm) =>
        setPattern(pattern.name, {[key]: mm === null ? null : `${Number(mm.toFixed(1))}mm`});
    return [
      choice(
          'paper', t('howLarge'),
          [
            ['a4', t('a4')], ['a5', t('a5')], ['postcard', t('postcard')], ['other', t('measured')],
            ['later', t('later')]
          ],
          paper, (value) => this.choosePaper(pattern, value)),
      paper === 'other' &&
          m('div.fields', m(LengthField, {
              id: 'width',
              label: t('width'),
              value: pattern.width_mm,
              least: 1,
              empty: true,
              choose: true,
              onvalue: set('width')
            }),
            pattern.corners && m(LengthField, {
              id: 'height',
              label: t('heightIfKnown'),
              value: pattern.height_mm,
              least: 1,
              empty: true,
              onvalue: set('height')
            })),
      paper === 'later' && m('p.small', t('laterWords'))
    ];
  }

  /**
   * @param {Studio.Pattern} pattern
   * @param {Studio.Kind} kind
   */
  chooseKind(pattern, kind) {
    this.kind = kind === pattern.kind ? null : kind;
    this.shape = {};
    if (kind !== 'flat' || pattern.kind === 'flat') return;
    this.kind = null;
    setPattern(pattern.name, {shape: null});
  }

  /**
   * Sizes of the project, or as typed so far; complete ones are written.
   * @param {Studio.Pattern} pattern
   * @param {Studio.Kind} kind
   * @returns {Typed}
   */
  shapeOf(pattern, kind) {
    if (pattern.kind !== kind) return this.shape;
    const {top_mm: top, bottom_mm: bottom, arc_deg: arc, box_mm: box, sides} = pattern;
    return {
      top,
      bottom,
      arc,
      width: box?.[0],
      height: box?.[1],
      depth: box?.[2],
      sides,
      ...this.shape
    };
  }

  /**
   * @param {Studio.Pattern} pattern
   * @param {Studio.Kind} kind
   * @param {Typed} values
   */
  setShape(pattern, kind, values) {
    Object.assign(this.shape, values);
    const {along} = this.shape;
    const round = diameters(kind, this.shapeOf(pattern, kind));
    if (along && round)
      Object.assign(this.shape, {along: undefined, arc: Number(arcOf(round, along).toFixed(1))});
    const {top, bottom, arc, width, height, depth, sides = {}} = this.shapeOf(pattern, kind);
    /** @param {number} value */
    const mm = (value) => `${Number(value.toFixed(2))}mm`;
    const words = kind === 'cylinder' ?
        top && arc && [`diameter=${mm(top)}`, `arc=${arc}`] :
        kind === 'cone' ?
        top && bottom && arc && [`top=${mm(top)}`, `bottom=${mm(bottom)}`, `arc=${arc}`] :
        width && height && depth && [
          `size=${[width, height].map((value) => Number(value.toFixed(2))).join('x')}x${mm(depth)}`,
          ...SIDES.filter((side) => sides[side]).map((side) => `${side}=${sides[side]}`)
        ];
    if (!words) return;
    // The shape tells the width; of a photo, the front's height makes its proportions those of the
    // box.
    const tall = kind === 'box' && pattern.corners && height ? mm(height) : null;
    const sizes = {
      ...(pattern.width_mm && {width: null}),
      ...((tall || pattern.height_mm) && {height: tall})
    };
    setPattern(pattern.name, {...sizes, shape: [kind, ...words].join(',')}).then(() => {
      this.kind = null;
      this.shape = {};
    });
  }

  /**
   * @param {Studio.Pattern} pattern
   * @param {Typed} shape
   * @param {Studio.Side} side
   */
  boxSide(pattern, {sides}, side) {
    return m(
        'div.field',
        m('label',
          { for: `side-${side}`
          },
          t(`side.${side}`)),
        m('select', {
          id: `side-${side}`,
          onchange: (event) => this.setShape(
              pattern, 'box', {sides: {...sides, [side]: event.target.value || undefined}}),
        },
          m('option', {value: ''}, t('none')),
          state.project.patterns.filter((other) => other !== pattern).map((other) => {
            const file = sideName(pattern.file, other.file);
            return m('option', {value: file, selected: sides?.[side] === file}, other.name);
          })));
  }

  /**
   * @param {Studio.Pattern} pattern
   * @param {Studio.Kind} kind
   */
  shapeFields(pattern, kind) {
    const shape = this.shapeOf(pattern, kind);
    /** @type {(key: Length, label: string, choose?: boolean) => Studio.Drawn} */
    const size = (key, label, choose = false) => m(LengthField, {
      id: key,
      label,
      value: shape[key],
      least: 1,
      choose,
      onvalue: (mm) => this.setShape(pattern, kind, {[key]: mm})
    });
    const round = diameters(kind, shape);
    const along = shape.along ?? (round && shape.arc ? alongOf(round, shape.arc) : null);
    if (kind === 'box') {
      return [
        m('div.fields', size('width', t('width'), true), size('height', t('height')),
          size('depth', t('depth'))),
        m('details', m('summary', t('sides')),
          m('div.fields', SIDES.map((side) => this.boxSide(pattern, shape, side))))
      ];
    }
    return [
      m('div.fields', size('top', t(kind === 'cone' ? 'diameterTop' : 'diameter'), true),
        kind === 'cone' && size('bottom', t('diameterBottom')), m(LengthField, {
          id: 'along',
          label: t('along'),
          value: along,
          least: 1,
          onvalue: (mm) => this.setShape(pattern, kind, {along: mm})
        }),
        m(NumberField, {
          id: 'arc',
          label: t('arc'),
          value: shape.arc,
          unit: '°',
          least: 1,
          most: 360,
          step: 5,
          onvalue: (arc) => this.setShape(pattern, kind, {arc})
        })),
      m('p.small', t('arcWords'))
    ];
  }

  /** @param {Studio.Pattern} pattern */
  shapes(pattern) {
    const kind = this.kind ?? pattern.kind;
    return [
      choice(
          'shape', t('whatShape'),
          KINDS.map(([value, shape]) => [value, t(`shape.${value}`), shape]), kind,
          (value) => this.chooseKind(pattern, value), {kind: '.tiles'}),
      kind === 'flat' ? this.sizes(pattern) : this.shapeFields(pattern, kind)
    ];
  }

  /**
   * Its name, which visitors read, and a field to change it.
   * @param {Studio.Pattern} pattern
   */
  title(pattern) {
    if (!this.naming) {
      return m('div.titled', head(name(pattern.name)), tool(t('rename'), 'pencil', () => {
                 this.naming = true;
               }));
    }
    /** @param {Studio.On<Event>} event */
    const done = (event) => {
      const wanted = event.target.value.trim();
      this.naming = false;
      if (!wanted || wanted === pattern.name) return;
      setPattern(pattern.name, {name: wanted}).then(() => {
        if (patternOf(wanted)) location.replace(`#/picture/${encodeURIComponent(wanted)}`);
      });
    };
    return m('div.field', m('label', { for: 'name'
             }, t('name')), m('input', {
               id: 'name',
               type: 'text',
               dir: 'auto',
               value: pattern.name,
               oncreate: ({dom}) => dom.select(),
               onchange: done,
               onkeydown: (event) => {
                 if (event.key === 'Enter') event.target.blur();
                 if (event.key === 'Escape') this.naming = false;
               },
               onblur: () => {
                 this.naming = false;
               }
             }));
  }

  /**
   * A frontal file becomes a photo: its corners are looked for, and are the photo's own where none
   * stand out.
   * @param {Studio.Pattern} pattern
   */
  async cutOut(pattern) {
    try {
      const {corners, sure} = await askJson('POST', 'corners', {file: pattern.file});
      if (!sure) unsure.add(pattern.name);
      await setPattern(pattern.name, {corners: toHundredths(corners)});
    } catch (error) { tellError(error); }
  }

  /** @param {Studio.Pattern} pattern */
  photoSize(pattern) {
    const known = photoSizes.get(pattern.file);
    if (known === undefined) {
      photoSizes.set(pattern.file, null);
      askJson('GET', `photo?pattern=${encodeURIComponent(pattern.name)}`)
          .then(({width, height}) => {
            photoSizes.set(pattern.file, [width, height]);
            m.redraw();
          })
          .catch(tellError);
    }
    return known ?? null;
  }

  /** @param {Studio.Pattern} pattern */
  stage(pattern) {
    const size = pattern.corners && this.photoSize(pattern);
    if (pattern.corners && !size) return null;
    if (pattern.corners && size) {
      return [
        m(Corners, {
          photo: thumb(pattern.file, STAGE_PX),
          size,
          corners: pattern.corners,
          onmove: (corners) => this.preview?.show(corners, true),
          onset: (corners) => {
            unsure.delete(pattern.name);
            setPattern(pattern.name, {corners});
          }
        }),
        m('p.hint', {id: 'corner-help'}, t('cornersHelp'))
      ];
    }
    return [
      m('div.frontal', m('img', {src: thumb(pattern.file, STAGE_PX), alt: pattern.name})),
      m('p.hint', t('frontal'), ' ',
        button(t('cutOut'), () => this.cutOut(pattern), {kind: '.link'}))
    ];
  }

  /**
   * The step after this one, with the model on the picture where there is but one.
   * @param {Studio.Pattern} pattern
   */
  onward(pattern) {
    const {models, scenes} = state.project;
    if (models.length === 1 && !scenes.some((scene) => scene.pattern === pattern.name))
      addScene(pattern.name, models[0].name);
  }

  /** @param {PictureVnode} vnode */
  view({attrs: {pattern}}) {
    const score = state.scores.get(pattern.name);
    return m(
        'div.work', rail('picture', pattern),
        m('section.stage', {'aria-label': t('photo')}, this.stage(pattern)),
        m('aside.panel',
          m('div.fill', this.title(pattern),
            unsure.has(pattern.name) && finding({text: t('unsure'), cure: t('unsureCure')}),
            score?.failed && finding({...said(score.failed), severity: 'error'}),
            m('div.seen', m(Preview, {
                pattern,
                score: this.features && score && !score.pending && !score.failed ? score : null,
                handle: (preview) => {
                  this.preview = preview;
                }
              }),
              m('div', verdict(pattern),
                m('label.check', m('input', {
                    type: 'checkbox',
                    checked: this.features,
                    onchange: (event) => {
                      this.features = event.target.checked;
                    }
                  }),
                  t('showFeatures')))),
            this.shapes(pattern), advice(pattern),
            m('p',
              button(
                  t('remove'), () => deleteAsset('pattern', pattern.name), {kind: '.link.small'}))),
          m('div.foot',
            state.project.models.length ?
                m('a.button.primary', {
                  href: `#/scene/${encodeURIComponent(pattern.name)}`,
                  onclick: () => this.onward(pattern)
                },
                  m('span', t('toScene')), icon('next')) :
                m('a.button.primary', {href: '#/files'}, m('span', t('toModel')), icon('next')))));
  }
}
