// What the modules of the page share: what the server says, and as much of Mithril as is used here.

interface Window {
  m: Studio.Mithril;
  /** Of a static page, which has no server. */
  modarStatic?: { kept: boolean; chosen: { name: string; folder?: object }; Projects: any };
}

declare namespace Studio {
  // ---- what the server says ----

  type Axis = 'x' | '-x' | 'y' | '-y' | 'z' | '-z';
  type Kind = 'flat' | 'cylinder' | 'cone' | 'box';
  type Side = 'right' | 'left' | 'top' | 'bottom' | 'back';
  type Sized = { width: number; height: number };
  /** x and y, or x, y and z. */
  type Point = number[];

  /** Words of the server, of the engine or of the page itself for a thing that is wrong. */
  interface Wrong {
    code?: string;
    error?: string;
    message?: string;
    text?: string;
    cure?: string;
    /** The file, and where in it. */
    file?: string;
    line?: number;
    where?: string;
    said?: { text: string; cure: string };
  }

  /** Of a bake or an export. */
  interface Failure extends Wrong {
    kind: string;
    errors?: Wrong[];
    package?: string | string[];
  }

  interface Asset {
    name: string;
    file: string;
    line: number;
  }

  interface Model extends Asset {
    missing: string[];
    triangles: number | null;
    /** Of its box; null: it was not baked. */
    size: Point | null;
    up: Axis | null;
    settings: Record<string, string>;
    /** What the bake repaired, by kind; null: nothing was requested. */
    repair: Record<string, { count: number; area: number }> | null;
    /** Its animations; null: it was not baked. */
    clips: string[] | null;
  }

  interface Pattern extends Asset {
    kind: Kind;
    corners: Point[] | null;
    width_mm: number | null;
    height_mm: number | null;
    top_mm: number | null;
    bottom_mm: number | null;
    arc_deg: number | null;
    box_mm: Point | null;
    sides: Partial<Record<Side, string>>;
    grade: string | null;
  }

  interface Scene {
    /** null: modar.toml does not name it, see whichScene(). */
    index: number | null;
    pattern: string;
    model: string;
    name: string;
    offset: Point;
    offset_unit: 'usual' | 'side' | 'mm';
    turn: Point;
    size: { kind: 'scale' | 'height' | 'width'; value: number };
    up: Axis | null;
    /** That plays; null: the model's first, 'none': no one. */
    clip: string | null;
    centred: boolean;
    texts: Record<string, string>;
    alts: Record<string, string>;
  }

  interface Project {
    revision: string;
    folder: string;
    name: string;
    /** Files that no project names yet. */
    init: { models: number; pictures: number } | null;
    bundle: { path: string; bytes: number; baked: boolean; stale: boolean; scenes: Scene[] | null };
    models: Model[];
    patterns: Pattern[];
    scenes: Scene[];
    settings: Record<string, string>;
    problems: Wrong[];
    undo: boolean;
    redo: boolean;
    languages: string[];
    phone: Phone | null;
    /** Why this machine makes no app; null: it makes them. */
    app: Wrong | null;
  }

  interface Phone {
    url: string;
    qr_svg: string;
  }

  interface Score {
    pattern: string;
    grade: string;
    range_widths: [number, number];
    range_cm: [number, number] | null;
    advice: { id: string; text: string }[];
    /** Of the picture, pixels. */
    width: number;
    height: number;
    /** x, y, and in how many views it is found. */
    features: [number, number, number][];
    views: number;
  }

  interface Rival {
    pattern: string;
    times: number;
    views: number;
  }

  /** Of the checker. */
  interface Finding {
    severity: string;
    id: string;
    text: string;
    cure: string;
    place?: { view: string; name?: string };
  }

  // ---- what the page makes of it ----

  /** What a person reads of something that is not well, see said(). */
  interface Said {
    text: Child;
    cure?: Child;
    detail?: string;
    lang?: string;
    severity?: string;
  }

  /** A file to send. */
  interface Sent {
    name: string;
    blob: Blob;
  }

  /** A scene on the stage: half and matrix see placing.js. */
  interface Placed extends Scene {
    key: string;
    asset: Model | undefined;
    half: Point;
    matrix: number[];
  }

  /** A drag of a handle: in the picture's space, about an axis by degrees, or a factor. */
  interface Change {
    move?: Point;
    turn?: [axis: number, degrees: number];
    size?: number;
  }

  interface Eye {
    /** Pattern space to eye space. */
    view: Float32Array;
    /** CSS pixels, as size. */
    focal: number;
    size: Sized;
  }

  interface Box {
    low: Point;
    high: Point;
  }

  /** Of modar.toml. */
  type Edit = { op?: string; table?: string; index?: number; [key: string]: unknown };
  /** Keys of a table; null takes one out. */
  type Values = Record<string, unknown>;

  // ---- Mithril ----

  /** What m() answers. */
  interface Drawn {
    tag: unknown;
  }

  type Child = Drawn | string | number | boolean | null | undefined | Child[];
  type On<Happened, Target = HTMLInputElement> = Happened & { target: Target; redraw?: boolean };

  interface Attributes {
    onchange?(event: On<Event>): unknown;
    oninput?(event: On<Event>): unknown;
    onblur?(event: On<FocusEvent>): unknown;
    onclick?(event: On<MouseEvent>): unknown;
    onkeydown?(event: On<KeyboardEvent>): unknown;
    onpointerdown?(event: On<PointerEvent>): unknown;
    onpointerenter?(event: On<PointerEvent>): unknown;
    onload?(event: On<Event, HTMLImageElement>): unknown;
    onerror?(event: On<Event, HTMLImageElement>): unknown;
    ontoggle?(event: On<Event, HTMLDetailsElement>): unknown;
    oncreate?(vnode: { dom: HTMLInputElement }): unknown;
    [name: string]: unknown;
  }

  interface Vnode<Attrs = {}, State = {}> {
    attrs: Attrs;
    state: State;
    dom: HTMLElement;
  }

  interface Component<Attrs, State = {}> {
    view(vnode: Vnode<Attrs, State>): Child;
  }

  type AttributesOf<Drawer> = Drawer extends { view(vnode: { attrs: infer Attrs }): Child } ? Attrs :
    Drawer extends new (...vnode: never[]) => { view(vnode: { attrs: infer Attrs }): Child } ? Attrs : {};

  interface Mithril {
    (selector: string, attributes?: Attributes | Child, ...children: Child[]): Drawn;
    <Drawer extends object>(component: Drawer, attributes: AttributesOf<Drawer> & { key?: string | number }): Drawn;
    redraw(): void;
    mount(root: Element, component: { view(): Child }): void;
  }
}

// What `modar studio` serves of the engine's page.
declare module '*/engine/turntable.js' {
  export const groundTransform: typeof import('../../../../runtime/extensions/web/turntable.js').groundTransform;
  export const viewFrom: typeof import('../../../../runtime/extensions/web/turntable.js').viewFrom;
}
declare module '*/engine/modar-view.js' {
  export const View: typeof import('../../../../runtime/extensions/web/modar-view.js').View;
  export type View = import('../../../../runtime/extensions/web/modar-view.js').View;
}
declare module '*/engine/modar.js' {
  export const load: typeof import('../../../../runtime/extensions/web/modar.js').load;
  export type Modar = import('../../../../runtime/extensions/web/modar.js').Modar;
}
