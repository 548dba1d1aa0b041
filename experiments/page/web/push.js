// A hand on the vehicle: drag it in the 3D scene, or push it by the buttons.

import {h, button} from 'page/dom.js';
import {rotate} from 'page/series.js';

const kSpring_newton_m = 25;
const kMost_newton = 12;
const kSendEvery_ms = 50;
const kButton_newton = 5;
const kButton_ms = 600;
const kColor = 0xff5533;
// in the vehicle's own axes: x ahead, y left, z up
const kWays = {
  ahead: [1, 0, 0],
  back: [-1, 0, 0],
  left: [0, 1, 0],
  right: [0, -1, 0],
  up: [0, 0, 1],
  down: [0, 0, -1],
};

export class Push {
  /** scene: a Scene3d that is ready; send(force): three numbers in N, in the world. */
  constructor(scene, send) {
    Object.assign(this, {scene, send});
    const T = scene.T;
    this.caster = new T.Raycaster();
    this.arrow = new T.ArrowHelper(new T.Vector3(1, 0, 0), new T.Vector3(), 0.1, kColor);
    this.arrow.visible = false;
    scene.world.add(this.arrow);
    // before the orbit controls see it
    const canvas = scene.canvas;
    canvas.addEventListener('pointerdown', event => this.grab(event), {capture: true});
    canvas.addEventListener('pointermove', event => this.drag(event), {capture: true});
    for (const name of ['pointerup', 'pointercancel'])
      canvas.addEventListener(name, () => this.release(), {capture: true});
    this.note = h('span', {class: 'note'});
    this.buttons = Object.keys(kWays).map(name =>
      button(name, () => this.nudge(kWays[name]), {title: `push ${name}, ${kButton_newton} N`}),
    );
    const label = {role: 'group', 'aria-label': 'push the vehicle'};
    this.element = h('div', {class: 'line', ...label}, this.note, this.buttons);
    this.stop('');
  }

  /** No pushing, for this reason; none: it may be pushed. */
  stop(why) {
    this.isStopped = Boolean(why);
    this.note.textContent = why || 'Drag the vehicle, or push it:';
    for (const one of this.buttons) one.disabled = this.isStopped;
    if (why) this.letGo();
  }

  at(event) {
    const box = this.scene.canvas.getBoundingClientRect();
    this.caster.setFromCamera(
      {
        x: (2 * (event.clientX - box.left)) / box.width - 1,
        y: 1 - (2 * (event.clientY - box.top)) / box.height,
      },
      this.scene.camera,
    );
    return this.caster;
  }

  grab(event) {
    if (event.button !== 0 || this.isStopped) return;
    const hit = this.at(event).intersectObject(this.scene.vehicle, true)[0];
    if (!hit) return;
    const T = this.scene.T;
    const canvas = this.scene.canvas;
    event.preventDefault();
    canvas.focus();
    canvas.setPointerCapture(event.pointerId);
    this.scene.controls.enabled = false;
    this.held = this.scene.vehicle.worldToLocal(hit.point.clone());
    this.plane = new T.Plane().setFromNormalAndCoplanarPoint(
      this.scene.camera.getWorldDirection(new T.Vector3()),
      hit.point,
    );
    this.sent = 0;
  }

  drag(event) {
    if (!this.held) {
      const over =
        event.buttons === 0 &&
        !this.isStopped &&
        this.at(event).intersectObject(this.scene.vehicle, true).length > 0;
      this.scene.canvas.style.cursor = over ? 'grab' : '';
      return;
    }
    const T = this.scene.T;
    const to = this.at(event).ray.intersectPlane(this.plane, new T.Vector3());
    if (!to) return;
    const from = this.scene.vehicle.localToWorld(this.held.clone());
    const force = to.sub(from).multiplyScalar(kSpring_newton_m).clampLength(0, kMost_newton);
    this.show(from, force);
    const now = performance.now();
    if (now - this.sent < kSendEvery_ms) return;
    this.sent = now;
    this.push(force.toArray());
  }

  release() {
    if (!this.held) return;
    this.letGo();
    this.push([0, 0, 0]);
  }
  letGo() {
    clearTimeout(this.timer);
    this.held = null;
    this.scene.controls.enabled = true;
    this.show(null);
  }

  nudge(way) {
    clearTimeout(this.timer);
    this.push(rotate(this.scene.pose || [0, 0, 0, 1, 0, 0, 0], way).map(x => kButton_newton * x));
    this.timer = setTimeout(() => this.push([0, 0, 0]), kButton_ms);
  }

  push(force) {
    this.send(force.map(x => Number(x.toFixed(2))));
  }

  show(from, force) {
    this.arrow.visible = Boolean(from) && force.length() > 0.05;
    if (this.arrow.visible) {
      this.arrow.position.copy(from);
      this.arrow.setDirection(force.clone().normalize());
      this.arrow.setLength(0.05 + (force.length() / kMost_newton) * 0.4, 0.07, 0.04);
    }
    this.scene.draw();
  }
}
