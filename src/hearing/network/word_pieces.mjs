// The pieces of words that the network reads and writes: Llama's, byte pairs of which the one made first joins first
// (R. Sennrich, B. Haddow and A. Birch, "Neural Machine Translation of Rare Words with Subword Units", 2016).

const kBlank = '▁';
const kByte = /^<0x[0-9A-F]{2}>$/;
const kFirstJoined = 259; // before it three marks and the bytes

export class WordPieces {
  /** `vocabulary`: a piece a line, in the order in which they were made. */
  constructor(vocabulary) {
    this.pieces = vocabulary.split('\n');
  }

  /** The number of a piece; undefined where it is none. */
  idOf(piece) {
    this.ids ??= new Map(this.pieces.map((each, id) => [each, id]));
    return this.ids.get(piece);
  }

  /** The numbers of the pieces of a text of words between single blanks, with a blank before it. */
  encode(text) {
    const bytesOf = (letter) => [...Buffer.from(letter)].map((byte) => `<0x${byte.toString(16).toUpperCase().padStart(2, '0')}>`);
    const parts = [...` ${text}`.replaceAll(' ', kBlank)].flatMap((letter) => (this.idOf(letter) === undefined ? bytesOf(letter) : [letter]));
    for (;;) {
      let first = Infinity;
      let at = -1;
      for (let i = 0; i + 1 < parts.length; ++i) {
        const id = this.idOf(parts[i] + parts[i + 1]);
        if (id >= kFirstJoined && id < first) [first, at] = [id, i];
      }
      if (at < 0) return parts.map((part) => this.idOf(part));
      parts.splice(at, 2, parts[at] + parts[at + 1]);
    }
  }

  /** The text of pieces, without the blank before it. */
  decode(ids) {
    const bytes = ids.map((id) => this.pieces[id] ?? '').map((piece) => (kByte.test(piece) ? Buffer.from(piece.slice(3, 5), 'hex') : Buffer.from(piece)));
    return Buffer.concat(bytes).toString('utf8').replaceAll(kBlank, ' ').replace(/^ /, '');
  }
}
