// TinyUSDZ finds the picture of a textured head in our USDZ: node read_usdz.mjs TALK.usdz
import { existsSync, readFileSync } from 'node:fs';
import { skip } from './environment.mjs';
import { startTinyUsdz } from './tinyusdz.mjs';

const file = process.argv[2];
if (!file || !existsSync(file)) skip(`${file} is not there`);
const reader = new (await startTinyUsdz()).TinyUSDZLoaderNative();
const expect = (holds, what) => {
  if (!holds) throw new Error(what);
};
expect(reader.loadFromBinary(new Uint8Array(readFileSync(file)), 'talk.usdz'), `TinyUSDZ: ${reader.error()}`);
expect(reader.numMeshes() === 1, `${reader.numMeshes()} meshes`);
const textured = reader.getMaterial(0).diffuseColorTextureId;
expect(textured === 0, `the skin's picture is ${textured}`);
expect(reader.getMaterial(1).diffuseColorTextureId === undefined, 'the teeth show a picture');
const image = reader.getImage(reader.getTexture(textured).textureImageId);
expect(image.uri === 'texture_0.png' && image.data[1] === 'P'.charCodeAt(0), `the picture is ${image.uri}`);
console.log(`usdz: ${reader.getMesh(0).points.length / 3} points, ${image.uri} on the skin`);
process.exit(0);
