// Vehicle, station and marker as MuJoCo compiled them, in three.js: the truth, and the estimate as a ghost.

import {h, button, fill, soon} from 'page/dom.js';
import {library} from 'page/data.js';
import {number} from 'page/format.js';
import {roundStep} from 'page/numbers.js';
import {compose} from 'page/series.js';
import {isDark, isOnPaper, kPaper_px, onTheme} from 'page/theme.js';

// Where from, in spans of the scene.
const kViews = {
  Side: [-0.25, -1, 0.35],
  Above: [-0.02, -0.001, 1.15],
  Behind: [-1.2, -0.32, 0.42],
};

const painted = () =>
  new Promise(resolve => {
    setTimeout(resolve, 400); // a hidden tab never paints
    requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(resolve)));
  });

// A browser has 16 of them: those of trials that are shown no longer are given back.
const scenes = new Set();

/** How far one could see, which stands in the picture as a grey sector where it is not far. */
const sightText = sight_m => (sight_m ? `; one could see ${number(sight_m, 2)} m` : '');
const kNear_m = 3;

export class Scene3d {
  /** trial: the model of a trial; await ready before update. */
  constructor(host, trial) {
    this.trial = trial;
    this.canvas = h('canvas', {
      tabindex: 0,
      role: 'img',
      class: 'scene',
      'aria-label':
        '3D replay: vehicle, station, marker and the estimated marker; drag turns, buttons choose a view',
    });
    const views = Object.keys(kViews).map(name =>
      button(name, () => this.view(name), {title: `look from: ${name}`}),
    );
    this.element = h(
      'div',
      {class: 'scene-box'},
      this.canvas,
      (this.paper = h('canvas', {class: 'paper', 'aria-hidden': 'true'})), // WebGL prints what it drew before
      h('div', {class: 'line overlay-bar'}, views),
      (this.key = h('div', {class: 'scene-key'})),
      (this.bar = h('div', {class: 'scale-bar'})),
    );
    host.append(this.element);
    this.draw = soon(() => this.drawNow());
    this.setSight(trial.sight_m);
    this.ready = this.start();
  }

  async start() {
    await painted(); // the rest of the page first: a slow machine compiles shaders for seconds
    await library('three.min.js');
    await library('OrbitControls.js');
    const T = (this.T = globalThis.THREE);
    const canvas = this.canvas;
    try {
      // kept for printing, and for whoever looks at the pixels
      this.renderer = new T.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
    } catch {
      fill(this.element, h('p', {class: 'note'}, 'This browser shows no 3D (WebGL is off).'));
      return;
    }
    for (const scene of scenes) if (!scene.canvas.isConnected) scene.end();
    scenes.add(this);
    this.renderer.gammaOutput = true;
    this.renderer.gammaFactor = 2.2;
    this.world = new T.Scene();
    this.camera = new T.PerspectiveCamera(40, 1, 0.02, 60);
    this.camera.up.set(0, 0, 1);
    this.sun = new T.DirectionalLight(0xffffff);
    this.sun.position.set(-2, -1.5, 4);
    this.sky = new T.HemisphereLight(0xdff1ff, 0x30404a);
    this.world.add(this.sky, this.sun);
    this.vehicle = new T.Group();
    this.station = new T.Group(); // its geoms are in the marker's frame
    this.place(this.station, this.trial.scene.X_WM);
    this.world.add(this.vehicle, this.station);
    for (const geom of this.trial.scene.geoms) this.addGeom(geom);
    this.ghost = this.makeGhost();
    this.world.add(this.ghost);
    this.trail = this.makeLine(0x4aa3e0, 1);
    this.toCome = this.makeLine(0x4aa3e0, 0.3);
    this.sight = this.makeLine(0x9fb4bf, 0.7);
    this.setSight(this.sight_m);
    this.controls = new T.OrbitControls(this.camera, canvas);
    this.controls.enableKeys = false;
    this.controls.enableZoom = false; // the page scrolls until the scene has the focus
    for (const name of ['focus', 'blur'])
      canvas.addEventListener(name, () => {
        this.controls.enableZoom = name === 'focus';
      });
    this.controls.addEventListener('change', this.draw);
    this.controls.addEventListener('start', () => (this.current = 'free'));
    this.offTheme = onTheme(() => (isOnPaper() ? this.drawNow() : this.draw()));
    this.sizes = new ResizeObserver(this.draw);
    this.sizes.observe(canvas);
    this.view('Side');
  }

  end() {
    scenes.delete(this);
    this.offTheme();
    this.sizes.disconnect();
    this.renderer.forceContextLoss();
    this.renderer.dispose();
    this.renderer = null;
  }

  material(geom) {
    const T = this.T;
    const [r, g, b, a] = geom.rgba;
    const color = new T.Color(Math.min(1, r), Math.min(1, g), Math.min(1, b));
    if (geom.part === 'environment')
      return new T.MeshLambertMaterial({
        color: 0x8fb1c0,
        transparent: true,
        opacity: 0.13,
        depthWrite: false,
        side: T.DoubleSide,
      });
    if (geom.name.startsWith('ball_'))
      return new T.MeshLambertMaterial({color, emissive: color.clone().multiplyScalar(0.55)});
    return new T.MeshLambertMaterial({color, transparent: a < 1, opacity: a});
  }

  geometry(geom) {
    const T = this.T;
    const [a, b, c] = geom.size_m;
    switch (geom.shape) {
      case 'sphere':
        return new T.SphereBufferGeometry(a, 24, 16);
      case 'box':
        return new T.BoxBufferGeometry(2 * a, 2 * b, 2 * c);
      case 'ellipsoid':
        return new T.SphereBufferGeometry(1, 24, 16).scale(a, b, c);
      case 'cylinder':
        return new T.CylinderBufferGeometry(a, a, 2 * b, 28).rotateX(Math.PI / 2);
      case 'plane':
        return new T.PlaneBufferGeometry(2 * (a || 15), 2 * (b || 15));
      case 'capsule': {
        const points = Array.from({length: 18}, (_, i) => {
          const angle = (Math.PI / 16) * (i < 9 ? i - 8 : i - 9); // from the lower pole to the upper
          return new T.Vector2(a * Math.cos(angle), (i < 9 ? -b : b) + a * Math.sin(angle));
        });
        return new T.LatheBufferGeometry(points, 24).rotateX(Math.PI / 2);
      }
      case 'mesh': {
        const mesh = this.trial.scene.meshes[geom.mesh];
        const geometry = new T.BufferGeometry();
        geometry.setAttribute('position', new T.Float32BufferAttribute(mesh.vertices_m, 3));
        geometry.setIndex(mesh.triangles);
        const flat = geometry.toNonIndexed();
        flat.computeVertexNormals();
        return flat;
      }
    }
    return null;
  }

  addGeom(geom) {
    const geometry = this.geometry(geom);
    if (!geometry) return;
    const mesh = new this.T.Mesh(geometry, this.material(geom));
    this.place(mesh, geom.pose);
    mesh.name = geom.name;
    (({vehicle: this.vehicle, moored_body: this.station})[geom.fixed_to] || this.world).add(mesh);
  }

  place(object, [x, y, z, w, a, b, c]) {
    object.position.set(x, y, z);
    object.quaternion.set(a, b, c, w);
  }

  /** The marker where the estimate has it: its balls as shells. */
  makeGhost() {
    const T = this.T;
    const group = new T.Group();
    for (const ball of this.trial.marker.balls) {
      const color = new T.Color(...ball.display_rgb);
      const shell = new T.Mesh(
        new T.SphereBufferGeometry(ball.radius_m * this.trial.marker.outer_ring_ratio, 14, 10),
        new T.MeshBasicMaterial({color, wireframe: true, transparent: true, opacity: 0.55}),
      );
      shell.position.set(...ball.p_MQ_m);
      group.add(shell);
    }
    group.add(new T.AxesHelper(0.12));
    return group;
  }

  makeLine(color, opacity) {
    const T = this.T;
    const material = new T.LineBasicMaterial({color, opacity, transparent: opacity < 1});
    const line = new T.Line(new T.BufferGeometry(), material);
    line.frustumCulled = false;
    this.world.add(line);
    return line;
  }

  /** How far one can see in the water; the sector that a camera sees goes so far. */
  setSight(sight_m) {
    this.sight_m = sight_m;
    fill(this.key, 'blue: way of the cameras; wire: estimated marker', sightText(sight_m));
    if (!this.sight) return;
    const {rig} = this.trial;
    this.sight.visible = Boolean(sight_m) && sight_m < kNear_m;
    const half = Math.atan(rig.width_px / 2 / rig.left.fx_px);
    const points = Array.from({length: 17}, (_, i) => {
      const angle = half * (i / 8 - 1);
      return [sight_m * Math.cos(angle), sight_m * Math.sin(angle), 0];
    });
    const around = [[0, 0, 0], ...points, [0, 0, 0]].flat();
    const positions = new this.T.Float32BufferAttribute(around, 3);
    this.sight.geometry.setAttribute('position', positions);
    this.draw();
  }

  /** Ways of the camera head and of the estimated marker, from a Series. */
  setSeries(series) {
    if (!this.renderer) return;
    const heads = [];
    const step = Math.max(1, Math.floor(series.length / 1500));
    for (let i = 0; i < series.length; i += step) {
      const pose = series.pose('vehicle', i);
      if (pose) heads.push(...compose(pose, this.trial.scene.X_BH).slice(0, 3));
    }
    for (const line of [this.trail, this.toCome])
      line.geometry.setAttribute('position', new this.T.Float32BufferAttribute(heads, 3));
    this.step = step;
    this.way = heads;
    this.view(this.current); // it may have left the picture
  }

  /**
   * vehicle: pose in the world; marker and estimate: true and estimated pose of the marker in the
   * camera head, null for none; row: of the Series.
   */
  update(vehicle, marker, estimate, row) {
    if (!this.renderer || !vehicle) return;
    const gone = Math.floor(row / (this.step || 1)) + 1;
    this.trail.geometry.setDrawRange(0, gone);
    this.toCome.geometry.setDrawRange(gone - 1, Infinity);
    this.place(this.vehicle, vehicle);
    const head = compose(vehicle, this.trial.scene.X_BH);
    this.place(this.sight, head);
    if (marker) this.place(this.station, compose(head, marker));
    this.ghost.visible = Boolean(estimate);
    if (estimate) this.place(this.ghost, compose(head, estimate));
    this.draw();
  }

  view(name) {
    if (!this.renderer) return;
    if (!(name in kViews)) return this.draw();
    this.current = name;
    const T = this.T;
    // the marker and the whole way
    const marker = this.trial.scene.X_WM.slice(0, 3);
    const way = this.way?.length ? this.way : [marker[0] - 1.4, marker[1], marker[2]];
    const box = new T.Box3().setFromArray([...marker, ...way]);
    const wide = Math.max(1, 1 / this.camera.aspect);
    const span = 1.05 * wide * Math.max(1.1, box.getSize(new T.Vector3()).length() + 0.75);
    box.getCenter(this.controls.target).sub(new T.Vector3(0.12, 0, 0.05));
    const offset = new T.Vector3(...kViews[name]).multiplyScalar(span);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  drawNow() {
    if (!this.renderer) return;
    const canvas = this.canvas;
    const width = isOnPaper() ? kPaper_px : canvas.clientWidth;
    const height = canvas.clientHeight;
    if (!width || !height) return;
    const size = this.renderer.getSize(new this.T.Vector2());
    if (size.x !== width || size.y !== height) {
      this.renderer.setPixelRatio(Math.min(2, devicePixelRatio || 1));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      this.view(this.current);
    }
    const isNight = this.trial.night && !isOnPaper();
    this.sun.intensity = isNight ? 0.22 : 1.7;
    this.sky.intensity = isNight ? 0.16 : 1.5;
    this.renderer.setClearColor(isNight ? 0x010306 : isDark() ? 0x0c1b25 : 0xdbe8ee);
    this.renderer.render(this.world, this.camera);
    if (isOnPaper()) {
      Object.assign(this.paper, {width: canvas.width, height: canvas.height});
      this.paper.getContext('2d').drawImage(canvas, 0, 0);
    }
    this.drawBar(height);
  }

  /** A length at the distance of what is looked at. */
  drawBar(height) {
    const distance = this.camera.position.distanceTo(this.controls.target);
    const px_per_m = height / (2 * distance * Math.tan((this.camera.fov * Math.PI) / 360));
    const length_m = roundStep(50 / px_per_m);
    this.bar.style.width = `${length_m * px_per_m}px`;
    this.bar.textContent = length_m < 1 ? `${Math.round(100 * length_m)} cm` : `${length_m} m`;
  }
}
