// The retargeted markers: where they are, and small balls to show them.
import { Box3, Color, InstancedMesh, Matrix4, MeshStandardMaterial, SphereGeometry, Vector3 } from 'three';

const FEWEST_OF_A_FACE = 10;

export class ControlPoints {
  /** control: {names, count, frames, positions} in metres. */
  constructor(control, framesPerSecond) {
    this.control = control;
    this.framesPerSecond = framesPerSecond;
  }

  get isEmpty() {
    return this.control.count === 0 || this.control.frames === 0;
  }

  /** -1 when there is no such point. */
  indexOf(name) {
    return this.control.names.indexOf(name);
  }

  position(index, time, target = new Vector3()) {
    const { count, frames, positions } = this.control;
    const at = Math.min(Math.max(time * this.framesPerSecond, 0), frames - 1);
    const before = Math.floor(at);
    const after = Math.min(before + 1, frames - 1);
    const share = at - before;
    const value = (frame, axis) => positions[3 * (frame * count + index) + axis];
    return target.set(
      ...[0, 1, 2].map((axis) => (1 - share) * value(before, axis) + share * value(after, axis)),
    );
  }

  /** Box around the points of the first frame; null when they are too few to stand for a face. */
  box() {
    if (this.isEmpty || this.control.count < FEWEST_OF_A_FACE) return null;
    const box = new Box3();
    for (let i = 0; i < this.control.count; ++i) box.expandByPoint(this.position(i, 0));
    return box;
  }

  addTo(scene, size) {
    const material = new MeshStandardMaterial({ color: 0xffffff, roughness: 0.4, emissive: new Color(0x0f6f8f), emissiveIntensity: 0.9 });
    this.balls = new InstancedMesh(new SphereGeometry(0.009 * size, 16, 12), material, Math.max(this.control.count, 1));
    this.balls.visible = false;
    this.balls.frustumCulled = false;
    scene.add(this.balls);
  }

  setTime(time) {
    if (!this.balls?.visible || this.isEmpty) return;
    const matrix = new Matrix4();
    const position = new Vector3();
    for (let i = 0; i < this.control.count; ++i) {
      this.balls.setMatrixAt(i, matrix.setPosition(this.position(i, time, position)));
    }
    this.balls.instanceMatrix.needsUpdate = true;
  }
}
