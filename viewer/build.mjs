// Builds the page template: node build.mjs OUTPUT.html. One file: style and script inlined, nothing fetched.
// Node modules are looked for in MOUTHPIECE_NODE_MODULES (the build folder's), else beside this file.
import { createHash } from 'node:crypto';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const modules = process.env.MOUTHPIECE_NODE_MODULES ?? join(here, 'node_modules');
const esbuild = createRequire(join(modules, 'anchor.js'))('esbuild');

const output = process.argv[2];
if (!output) {
  console.error('usage: node build.mjs OUTPUT.html');
  process.exit(2);
}

async function bundled(entry) {
  const result = await esbuild.build({
    entryPoints: [join(here, 'src', entry)],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: ['es2022'],
    charset: 'ascii',
    legalComments: 'inline',
    nodePaths: [modules],
    logLevel: 'warning',
  });
  return result.outputFiles[0].text;
}

function replaceOnce(text, marker, replacement) {
  const parts = text.split(marker);
  if (parts.length !== 2) throw new Error(`page.html: ${marker} occurs ${parts.length - 1} times; expected once`);
  return parts.join(replacement);
}

const script = await bundled('main.js');
const style = await bundled('style.css');
for (const [name, text] of Object.entries({ script, style })) {
  if (/<\/(script|style)|<!--/i.test(text)) throw new Error(`the built ${name} would end its own element`);
}
// Only this very script may run: text that came into the page from outside cannot.
const hash = createHash('sha256').update(script).digest('base64');
let page = readFileSync(join(here, 'src', 'page.html'), 'utf8');
page = replaceOnce(page, '@SCRIPT_HASH@', `sha256-${hash}`);
page = replaceOnce(page, '/* @STYLE@ */', style);
page = replaceOnce(page, '/* @SCRIPT@ */', script);
if (page.split('<!-- mouthpiece:data -->').length !== 2) throw new Error('page.html: expected one mouthpiece:data line');

mkdirSync(dirname(output), { recursive: true });
writeFileSync(output, page);
