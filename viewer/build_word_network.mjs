// Builds the program that hears words, hear_words.mjs, with ONNX Runtime for this machine beside it:
// node build_word_network.mjs SOURCE.mjs OUT_FOLDER.
import { copyFileSync, existsSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

const modules = process.env.MOUTHPIECE_NODE_MODULES ?? new URL('node_modules', import.meta.url).pathname;
const esbuild = createRequire(join(modules, 'anchor.js'))('esbuild');
const [source, folder] = process.argv.slice(2);
const binaries = join(modules, 'onnxruntime-node', 'bin', 'napi-v3', process.platform, process.arch);

mkdirSync(folder, { recursive: true });
for (const name of readdirSync(binaries)) {
  if (!name.includes('providers')) copyFileSync(join(binaries, name), join(folder, name));
}
const licences = ['onnxruntime-node', 'onnxruntime-common', 'llama-tokenizer-js'].map((name) => {
  const facts = JSON.parse(readFileSync(join(modules, name, 'package.json'), 'utf8'));
  const file = ['LICENSE', 'LICENSE.md'].map((own) => join(modules, name, own)).find(existsSync);
  const author = typeof facts.author === 'string' ? facts.author : facts.author?.name;
  return `${name} ${facts.version}: ${facts.license}, (c) ${author}\n${file ? readFileSync(file, 'utf8') : ''}`;
});
writeFileSync(join(folder, 'LICENSES'), licences.join('\n'));
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
