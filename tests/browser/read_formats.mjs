// What other programs' readers find in our files: node read_formats.mjs FOLDER (a line as line.vrma, line.usda, line.a2f.json).
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { pathFromViewer, requireFromViewer, skip } from './environment.mjs';
import { startTinyUsdz } from './tinyusdz.mjs';

const folder = process.argv[2];
if (!folder || !existsSync(join(folder, 'line.vrma'))) skip(`no line in ${folder}`);
const bytesOf = (name) => readFileSync(join(folder, name));
const importFromViewer = (path) => import(pathToFileURL(pathFromViewer(path)).href);
const expect = (holds, what) => {
  if (!holds) throw new Error(what);
};
const a2f = JSON.parse(bytesOf('line.a2f.json'));
const seconds = (a2f.numFrames - 1) / a2f.exportFps;

// VRM Animation: Khronos' validator, and the reader of three-vrm, which viewers of VRM use.
const report = await requireFromViewer('gltf-validator').validateBytes(new Uint8Array(bytesOf('line.vrma')));
expect(report.issues.numErrors === 0 && report.issues.numWarnings === 0, JSON.stringify(report.issues.messages));
globalThis.self = globalThis;
const { GLTFLoader } = await importFromViewer('three/examples/jsm/loaders/GLTFLoader.js');
const { VRMAnimationLoaderPlugin } = await importFromViewer('@pixiv/three-vrm-animation/lib/three-vrm-animation.module.js');
const loader = new GLTFLoader();
loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
const vrma = bytesOf('line.vrma');
const loaded = await loader.parseAsync(vrma.buffer.slice(vrma.byteOffset, vrma.byteOffset + vrma.length), '');
const [animation] = loaded.userData.vrmAnimations;
expect(Math.abs(animation.duration - seconds) < 1e-3, `lasts ${animation.duration} s, not ${seconds}`);
const tracks = animation.expressionTracks.preset;
for (const name of ['aa', 'ih', 'ou', 'ee', 'oh', 'blinkLeft', 'blinkRight']) {
  expect(tracks.get(name)?.times.length === a2f.numFrames, `no ${name} in every frame`);
  expect(tracks.get(name).values.every((value) => value >= 0 && value <= 1), `${name} leaves 0 to 1`);
}
expect(Math.max(...tracks.get('aa').values) > 0.9, 'the vowel of "hot" is not said');
console.log(`vrma: ${tracks.size} expressions, ${animation.duration.toFixed(2)} s`);

// USD: TinyUSDZ, another implementation than Pixar's, which Debian has no package of.
const usd = await startTinyUsdz();
const native = new usd.TinyUSDZLoaderNative();
expect(native.loadFromBinary(new Uint8Array(bytesOf('line.usda')), 'line.usda'), `TinyUSDZ: ${native.error()}`);
expect(native.numMeshes() === 1, `${native.numMeshes()} meshes`);
const mesh = native.getMesh(0);
const points = mesh.points.length / 3;
expect(points > 1000 && mesh.points.every(Number.isFinite), 'no points');
const layer = new usd.TinyUSDZLoaderNative();
expect(layer.loadAsLayerFromBinary(new Uint8Array(bytesOf('line.usda')), 'line.usda'), `as a layer: ${layer.error()}`);
const text = layer.layerToString();
const shapes = text.match(/def BlendShape/g)?.length ?? 0;
expect(shapes > 5, `${shapes} blend shapes`);
expect(text.includes('blendShapeWeights.timeSamples'), 'no keys');
console.log(`usda: ${points} points, ${shapes} blend shapes`);
process.exit(0);
