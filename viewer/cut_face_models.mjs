// Cuts the two networks of MediaPipe's FaceMesh (refined landmarks) out of the npm package's bundle:
// node cut_face_models.mjs OUT_FOLDER. Where each begins and ends stands in the package's own loader.
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const modules = process.env.MOUTHPIECE_NODE_MODULES ?? new URL('node_modules', import.meta.url).pathname;
const source = join(modules, '@mediapipe', 'face_mesh');
const wanted = {
  'face_landmark_with_attention.tflite': 'face_landmarks.tflite',
  'face_detection_short_range.tflite': 'face_detection.tflite',
};

const loader = readFileSync(join(source, 'face_mesh_solution_packed_assets_loader.js'), 'utf8');
const bundle = readFileSync(join(source, 'face_mesh_solution_packed_assets.data'));
const folder = process.argv[2];
mkdirSync(folder, { recursive: true });
for (const [name, ours] of Object.entries(wanted)) {
  const entry = new RegExp(`"filename":\\s*"[^"]*/${name}",\\s*"start":\\s*(\\d+),\\s*"end":\\s*(\\d+)`).exec(loader);
  if (!entry) throw new Error(`${source} holds no ${name}; expected @mediapipe/face_mesh 0.4`);
  const bytes = bundle.subarray(Number(entry[1]), Number(entry[2]));
  if (bytes.toString('latin1', 4, 8) !== 'TFL3') throw new Error(`${name} in ${source} is no network`);
  writeFileSync(join(folder, ours), bytes);
}
