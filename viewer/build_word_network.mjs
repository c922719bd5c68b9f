// Builds the program that hears words, hear_words.mjs, with ONNX Runtime for this machine and the words' pieces beside it:
// node build_word_network.mjs SOURCE.mjs OUT_FOLDER.
import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const modules = process.env.MOUTHPIECE_NODE_MODULES ?? new URL('node_modules', import.meta.url).pathname;
const esbuild = createRequire(join(modules, 'anchor.js'))('esbuild');
const [source, folder] = process.argv.slice(2);
const binaries = join(modules, 'onnxruntime-node', 'bin', 'napi-v3', process.platform, process.arch);

mkdirSync(folder, { recursive: true });
for (const name of readdirSync(binaries)) {
  if (!name.includes('providers')) copyFileSync(join(binaries, name), join(folder, name));
}
// ONNX Runtime's packages hold no text of their licence; the tokenizer's is the same.
const versionOf = (name) => JSON.parse(readFileSync(join(modules, name, 'package.json'), 'utf8')).version;
writeFileSync(join(folder, 'LICENSES'),
  `onnxruntime-node ${versionOf('onnxruntime-node')}, Copyright (c) Microsoft Corporation: MIT, as below\n\n` +
  `llama-tokenizer-js ${versionOf('llama-tokenizer-js')}: ` +
  readFileSync(join(modules, 'llama-tokenizer-js', 'LICENSE.md'), 'utf8'));
// The package makes tables of them at each start; a list is enough (word_pieces.mjs).
const { default: tokenizer } = await import(pathToFileURL(join(modules, 'llama-tokenizer-js', 'llama-tokenizer.js')));
writeFileSync(join(folder, 'word_pieces.txt'), tokenizer.vocabById.join('\n'));
await esbuild.build({
  entryPoints: [source],
  outfile: join(folder, 'hear_words.mjs'),
  bundle: true,
  platform: 'node',
  format: 'esm',
  target: ['node18'],
  nodePaths: [modules],
  banner: { js: "import { createRequire } from 'node:module'; const require = createRequire(import.meta.url);" },
  legalComments: 'inline',
  logLevel: 'warning',
  plugins: [{
    name: 'beside',
    setup(build) {
      // The package's own binding.js looks for the binary by platform, in the package's folders.
      build.onLoad({ filter: /onnxruntime-node\/dist\/binding\.js$/ }, () => ({
        contents: "exports.binding = require('./onnxruntime_binding.node');",
      }));
      build.onResolve({ filter: /\.node$/ }, (found) => ({ path: found.path, external: true }));
    },
  }],
});
