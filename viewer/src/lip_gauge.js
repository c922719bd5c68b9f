// Measures the lips of the displayed face: what is seen, not what was planned.
import { Vector3 } from 'three';

/** The vertex as it is shown now, morph targets included, in metres. */
function shownPosition(mesh, vertex) {
  return mesh.getVertexPosition(vertex, new Vector3()).applyMatrix4(mesh.matrixWorld);
}

/** The skin or lip vertex that rests nearest to `point`; a line begins in silence, so near the rest pose. */
function nearestVertex(meshes, point) {
  let best = { distance: Infinity };
  const position = new Vector3();
  for (const mesh of meshes) {
    if (!['skin', 'lips'].includes(mesh.userData.kind)) continue;
    const positions = mesh.geometry.attributes.position;
    for (let vertex = 0; vertex < positions.count; ++vertex) {
      const distance = position.fromBufferAttribute(positions, vertex).applyMatrix4(mesh.matrixWorld).distanceToSquared(point);
      if (distance < best.distance) best = { mesh, vertex, distance };
    }
  }
  return best.mesh ? best : null;
}

export class LipGauge {
  constructor(meshes, controlPoints) {
    const ends = ['LIP_UP_MID', 'LIP_LO_MID'].map((name) => {
      const index = controlPoints.indexOf(name);
      return index < 0 || controlPoints.isEmpty ? null : nearestVertex(meshes, controlPoints.position(index, 0));
    });
    this.ends = ends.every(Boolean) ? ends : null;
  }

  /** Millimetres between the middles of the lips; NaN when the face has no such markers. */
  opening() {
    if (!this.ends) return NaN;
    const [upper, lower] = this.ends.map(({ mesh, vertex }) => shownPosition(mesh, vertex));
    return 1000 * upper.distanceTo(lower);
  }
}
