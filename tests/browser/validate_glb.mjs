// Judges GLB files with the Khronos glTF validator: node validate_glb.mjs FILE...
// Exit 0: no error and no warning in any of them.
import { existsSync, readFileSync } from 'node:fs';
import { requireFromViewer, skip } from './environment.mjs';

if (process.argv.length < 3) {
  console.error('usage: node validate_glb.mjs FILE...');
  process.exit(2);
}
const missing = process.argv.slice(2).find((file) => !existsSync(file));
if (missing) skip(`${missing} is not there`);
const validator = requireFromViewer('gltf-validator');

const severities = ['error', 'warning', 'information', 'hint'];
let clean = true;
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 20 });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  const { totalVertexCount, totalTriangleCount, hasMorphTargets, animationCount } = report.info;
  console.log(
    `${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} notes, ${numHints} hints; ` +
      `${totalVertexCount} vertices, ${totalTriangleCount} triangles, morph targets: ${hasMorphTargets}, ` +
      `${animationCount} animation`,
  );
  for (const message of messages) console.log(`  ${severities[message.severity]} ${message.code} at ${message.pointer}: ${message.message}`);
  clean &&= numErrors === 0 && numWarnings === 0;
}
process.exit(clean ? 0 : 1);
