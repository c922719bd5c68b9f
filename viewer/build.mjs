// Builds the page template and, beside it, serve.html and studio.html: node build.mjs OUTPUT.html. Each is one file: style and script
// inlined, nothing fetched.
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
  if (parts.length !== 2) throw new Error(`a page: ${marker} occurs ${parts.length - 1} times; expected once`);
  return parts.join(replacement);
}

/** One page with its style and script; only this very script may run: text that came in from outside cannot. */
async function builtPage(html, entry, css) {
  const script = await bundled(entry);
  const style = await bundled(css);
  for (const [name, text] of Object.entries({ script, style })) {
    if (/<\/(script|style)|<!--/i.test(text)) throw new Error(`the built ${name} of ${html} would end its own element`);
  }
  const hash = createHash('sha256').update(script).digest('base64');
  let page = readFileSync(join(here, 'src', html), 'utf8');
  page = replaceOnce(page, '@SCRIPT_HASH@', `sha256-${hash}`);
  page = replaceOnce(page, '/* @STYLE@ */', style);
  return replaceOnce(page, '/* @SCRIPT@ */', script);
}

const page = await builtPage('page.html', 'main.js', 'style.css');
if (page.split('<!-- mouthpiece:data -->').length !== 2) throw new Error('page.html: expected one mouthpiece:data line');

mkdirSync(dirname(output), { recursive: true });
writeFileSync(output, page);
writeFileSync(join(dirname(output), 'serve.html'), await builtPage('serve/serve.html', 'serve/main.js', 'serve/serve.css'));
writeFileSync(join(dirname(output), 'studio.html'), await builtPage('studio/studio.html', 'studio/main.js', 'studio/studio.css'));
