// @ts-check
// A-Frame: entities on the prints of a bundle; pages for MindAR's and 8th Wall's image targets. A
// classic script or a module, after A-Frame and before <a-scene>.
(() => {
  const {AFRAME} = /** @type {any} */ (globalThis);
  if (!AFRAME) throw new Error('modar/aframe: load A-Frame before it');
  const {THREE} = AFRAME;
  const ofScript = /** @type {HTMLElement | null} */ (globalThis.document?.currentScript)?.dataset;
  /**
   * Pages of MindAR pick entities in pixels of a picture: its width in them.
   */
  const MINDAR_WIDTH = 1000;
  const [MINDAR_NEAR, MINDAR_FAR] = [10, 100000];

  /** @typedef {(name: string, view: Float32Array | null, pose: any) => void} Place */

  /**
   * @param {any} scene the element
   * @param {string} bundle
   * @param {{near: number, far: number, place: Place}} engine
   * @param {object} [options]
   */
  async function begin(scene, bundle, {near, far, place}, options) {
    if (!bundle || bundle.endsWith('.mind'))
      throw new Error(`modar/aframe: "${bundle}" is no bundle: \`modar adopt\` makes one`);
    const {follow} = await import('./follow.js');
    return follow(
        new URL(bundle, document.baseURI), {
          canvas: scene.canvas,
          near,
          far,
          place,
          draw(_, projection) {
            scene.camera.projectionMatrix.fromArray(projection);
            scene.camera.projectionMatrixInverse.copy(scene.camera.projectionMatrix).invert();
          },
        },
        options);
  }

  /** @param {any} object */
  function hide(object) { Object.assign(object, {matrixAutoUpdate: false, visible: false}); }

  /**
   * @param {any} object
   * @param {any} scene
   * @param {any} matrix to eye space
   */
  function put(object, scene, matrix) {
    scene.camera.updateMatrixWorld();
    object.matrix.copy(matrix).premultiply(scene.camera.matrixWorld);
    object.matrixWorldNeedsUpdate = true;
    object.visible = true;
  }

  /**
   * Where the picture's top left corner is, in pattern space: half its width and height.
   * @param {{view: Float32Array, corners: Float32Array, camera: any}} pose
   */
  function halfOf({view: v, corners: [x, y], camera: {width, height, focal}}) {
    const toEye = new THREE.Matrix3().set(v[0], v[4], v[12], v[1], v[5], v[13], v[2], v[6], v[14]);
    const at = new THREE.Vector3(x - (width - 1) / 2, (height - 1) / 2 - y, -focal);
    at.applyMatrix3(toEye.invert());
    return [Math.abs(at.x / at.z), Math.abs(at.y / at.z)];
  }

  AFRAME.registerSystem('modar', {
    schema: {src: {default: ''}, extended: {default: false}, autoStart: {default: true}},
    init() {
      /** @type {Map<string, any[]>} */
      this.prints = new Map();
      if (this.data.src && this.data.autoStart)
        this.el.addEventListener('renderstart', () => this.start());
    },
    async start() {
      const {near, far} = this.el.camera;
      /** @type {Place} */
      const place = (name, view, pose) => {
        for (const el of this.prints.get(name) ?? []) {
          const known = el.object3D.visible;
          if (view) put(el.object3D, this.el, new THREE.Matrix4().fromArray(view));
          else el.object3D.visible = false;
          if (known !== (view !== null)) el.emit(view ? 'printfound' : 'printlost', pose);
        }
      };
      try {
        const {src, extended} = this.data;
        this.following = await begin(this.el, src, {near, far, place}, {extended});
        this.el.emit('modarready', {modar: this.following.modar});
      } catch (error) { this.el.emit('modarerror', {error}); }
    },
    stop() { this.following?.close(); },
  });
  AFRAME.registerComponent('modar-print', {
    schema: {type: 'string'},
    init() { hide(this.el.object3D); },
    update(/** @type {string} */ old) {
      const {prints} = this.el.sceneEl.systems.modar;
      this.leave(old);
      prints.set(this.data, [...prints.get(this.data) ?? [], this.el]);
    },
    remove() { this.leave(this.data); },
    leave(/** @type {string} */ name) {
      const {prints} = this.el.sceneEl.systems.modar;
      prints.set(name, (prints.get(name) ?? []).filter((/** @type {any} */ el) => el !== this.el));
    },
  });

  // ---- MindAR ----

  const STYLE = 'position:absolute;inset:0;z-index:2;display:flex;pointer-events:none;' +
      'align-items:center;justify-content:center;font:1rem sans-serif;color:#fff';
  /** @type {Record<string, string>} */
  const OVERLAYS = {
    Loading: '<div style="padding:1em;background:#000a;border-radius:1em">…</div>',
    Scanning: '<div style="width:60vmin;height:60vmin;border:3px dashed;border-radius:1em"></div>',
    Error: '<div style="padding:1em;background:#000a;border-radius:1em;margin:1em"></div>',
  };

  AFRAME.registerSystem('mindar-image-system', {
    init() { Object.assign(this, {anchors: [], shown: new Set(), only: -1, overlays: {}}); },
    setup(/** @type {any} */ settings) {
      this.settings = settings;
      for (const kind of Object.keys(OVERLAYS)) this.overlays[kind] = this.overlay(kind);
    },
    overlay(/** @type {string} */ kind) {
      const which = this.settings[`ui${kind}`];
      if (which === 'no') return null;
      if (which !== 'yes') return document.querySelector(which);
      const made = document.createElement('div');
      made.className = 'mindar-ui-overlay hidden';
      made.innerHTML =
          `<style>.mindar-ui-overlay.hidden{display:none!important}</style>${OVERLAYS[kind]}`;
      made.style.cssText = STYLE;
      this.el.parentNode.append(made);
      return made;
    },
    show(/** @type {string} */ kind, text = '') {
      for (const [each, overlay] of Object.entries(this.overlays))
        overlay?.classList.toggle('hidden', each !== kind);
      if (text && this.overlays[kind]?.lastChild) this.overlays[kind].lastChild.textContent = text;
    },
    registerAnchor(
        /** @type {any} */ component,
        /** @type {number} */ target) { this.anchors.push({el: component.el, target}); },
    async start() {
      this.show('Loading');
      this.paused = false;
      this.halves = new Map();
      this.missed = new Map();
      /** @type {Place} */
      const place = (name, view, pose) => this.place(name, view, pose);
      try {
        this.following = await begin(
            this.el, this.settings.imageTargetSrc, {near: MINDAR_NEAR, far: MINDAR_FAR, place});
        this.video = this.following.video;
        this.el.emit('arReady');
        this.show(this.shown.size ? '' : 'Scanning');
      } catch (error) {
        this.show('Error', /** @type {Error} */ (error).message);
        this.el.emit('arError', {error: 'VIDEO_FAIL', reason: error});
      }
    },
    place(/** @type {string} */ name, /** @type {any} */ view, /** @type {any} */ pose) {
      const target = pose.pattern;
      const wanted = this.only === -1 || this.only === target;
      const free = this.shown.has(target) || this.shown.size < this.settings.maxTrack;
      if (this.paused) this.missed.set(name, () => this.place(name, view, pose));
      if (this.paused || (view && !(wanted && free))) return;
      if (view && !this.halves.has(target)) this.halves.set(target, halfOf(pose));
      for (const {el, target: own} of this.anchors)
        if (own === target) this.move(el, view, target);
      if (view) this.shown.add(target);
      else this.shown.delete(target);
      this.show(this.shown.size ? '' : 'Scanning');
    },
    move(/** @type {any} */ el, /** @type {any} */ view, /** @type {number} */ target) {
      const {visible} = el.object3D;
      el.emit('targetUpdate');
      if (!view) {
        el.object3D.visible = false;
        if (visible) el.emit('targetLost');
        return;
      }
      const width = 2 * this.halves.get(target)[0];
      const enlarged = MINDAR_WIDTH / width;
      const matrix = new THREE.Matrix4().makeScale(enlarged, enlarged, enlarged);
      matrix.multiply(new THREE.Matrix4().fromArray(view));
      put(el.object3D, this.el, matrix.scale(new THREE.Vector3(width, width, width)));
      if (!visible) el.emit('targetFound');
    },
    switchTarget(/** @type {number} */ target) { this.only = target; },
    pause(keepVideo = false) {
      this.paused = true;
      if (!keepVideo) this.video?.pause();
    },
    unpause() {
      this.paused = false;
      for (const place of this.missed?.values() ?? []) place();
      this.missed?.clear();
      this.video?.play();
    },
    stop() {
      this.paused = true;
      this.following?.close();
      this.shown.clear();
      for (const {el} of this.anchors) el.object3D.visible = false;
      this.show('');
    },
  });
  const number = {type: 'number', default: -1};
  AFRAME.registerComponent('mindar-image', {
    dependencies: ['mindar-image-system'],
    schema: {
      imageTargetSrc: {type: 'string'},
      maxTrack: {type: 'int', default: 1},
      // Accepted: the tracker needs no filter, and no tolerances.
      filterMinCF: number,
      filterBeta: number,
      missTolerance: number,
      warmupTolerance: number,
      showStats: {type: 'boolean', default: false},
      autoStart: {type: 'boolean', default: true},
      uiLoading: {type: 'string', default: 'yes'},
      uiScanning: {type: 'string', default: 'yes'},
      uiError: {type: 'string', default: 'yes'},
    },
    init() {
      const system = this.el.sceneEl.systems['mindar-image-system'];
      system.setup(this.data);
      if (this.data.autoStart)
        this.el.sceneEl.addEventListener('renderstart', () => system.start());
    },
    remove() { this.el.sceneEl.systems['mindar-image-system'].stop(); },
  });
  AFRAME.registerComponent('mindar-image-target', {
    dependencies: ['mindar-image-system'],
    schema: {targetIndex: {type: 'number'}},
    init() {
      hide(this.el.object3D);
      this.el.sceneEl.systems['mindar-image-system'].registerAnchor(this, this.data.targetIndex);
    },
  });

  // ---- 8th Wall ----

  AFRAME.registerComponent('xrweb', {
    schema: {
      bundle: {default: ''},
      disableWorldTracking: {default: false},
      allowedDevices: {default: ''}
    },
    init() {
      const scene = this.el.sceneEl;
      const known = new Set(), halves = new Map();
      /** @type {Place} */
      const place = (name, view, pose) => {
        if (!view) {
          known.delete(name);
          scene.emit('xrimagelost', this.detail(name, halves.get(name)));
          return;
        }
        if (!halves.has(name)) halves.set(name, halfOf(pose));
        const detail = this.detail(name, halves.get(name), view);
        scene.emit(known.has(name) ? 'xrimageupdated' : 'xrimagefound', detail);
        known.add(name);
      };
      scene.addEventListener('renderstart', async () => {
        scene.camera.el.setAttribute('look-controls', 'enabled', false);
        const {near, far} = scene.camera;
        try {
          this.following =
              await begin(scene, this.data.bundle || ofScript?.bundle || '', {near, far, place});
          const {patterns} = this.following.modar;
          const imageTargets = patterns.map(
              (/** @type {{name: string}} */ {name}) => ({name, type: 'FLAT', metadata: null}));
          scene.emit('xrimagescanning', {imageTargets});
          scene.emit('realityready');
        } catch (error) { scene.emit('realityerror', {error}); }
      });
    },
    detail(/** @type {string} */ name, half = [0, 0], /** @type {Float32Array=} */ view) {
      const sizes = {scale: 2, scaledWidth: half[0], scaledHeight: half[1]};
      const placed = {position: new THREE.Vector3(), rotation: new THREE.Quaternion()};
      if (view) {
        const {camera} = this.el.sceneEl;
        camera.updateMatrixWorld();
        const matrix = new THREE.Matrix4().fromArray(view).premultiply(camera.matrixWorld);
        matrix.decompose(placed.position, placed.rotation, new THREE.Vector3());
      }
      return {name, type: 'FLAT', ...placed, ...sizes, properties: {}};
    },
    remove() { this.following?.close(); },
  });
  const named = {
    schema: {name: {type: 'string'}},
    /** @this {any} */
    init() {
      const {el, data} = this;
      el.object3D.visible = false;
      for (const type of ['xrimagefound', 'xrimageupdated', 'xrimagelost'])
        el.sceneEl.addEventListener(type, (/** @type {any} */ {detail}) => {
          if (detail.name !== data.name) return;
          el.object3D.visible = type !== 'xrimagelost';
          if (el.object3D.visible) {
            el.object3D.position.copy(detail.position);
            el.object3D.quaternion.copy(detail.rotation);
            el.object3D.scale.setScalar(detail.scale);
          }
          if (type !== 'xrimageupdated')
            el.emit(type === 'xrimagefound' ? 'xrextrasfound' : 'xrextraslost', {}, false);
        });
    },
  };
  const NAMED = 'xrextras-named-image-target';
  if (!AFRAME.components[NAMED]) {
    AFRAME.registerComponent(NAMED, named);
    AFRAME.registerPrimitive(
        NAMED, {defaultComponents: {[NAMED]: {}}, mappings: {name: `${NAMED}.name`}});
  }
  const wall = /** @type {any} */ (globalThis);
  wall.XR8 ??= {XrController: {configure() {}, recenter() {}}};
  globalThis.dispatchEvent?.(new Event('xrloaded'));
})();
