// Pieces of words as the package that they come from makes them: node word_pieces_test.mjs SHARE_FOLDER TEXT...
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { WordPieces } from '../../../src/hearing/network/word_pieces.mjs';

const [folder, ...files] = process.argv.slice(2);
const { default: theirs } = await import(
  pathToFileURL(join(process.env.MOUTHPIECE_NODE_MODULES, 'llama-tokenizer-js', 'llama-tokenizer.js')));
const ours = new WordPieces(readFileSync(join(folder, 'word_network', 'word_pieces.txt'), 'utf8'));
const lines = files.flatMap((file) => readFileSync(file, 'utf8').split('\n')).map((line) => line.trim().replaceAll(/ +/g, ' '));
assert(lines.length > 200);
lines.push('a\ttab', '90 °C, 5 €', 'Größe 東京 \u{1F600}', '<0x41> <s> </s>', 'aaaaaaaaaaaaaaaaaaaaaaa', '1234567890');
for (const line of lines.filter((each) => each !== '')) {
  const pieces = ours.encode(line);
  assert.deepEqual(pieces, theirs.encode(line, false, true), line);
  assert.equal(ours.decode(pieces), theirs.decode(pieces, false, true), line);
  assert.equal(ours.decode(pieces.slice(0, -1)), theirs.decode(pieces.slice(0, -1), false, true), line);
}
assert.equal(ours.idOf('.'), theirs.encode('.', false, false)[0]);
