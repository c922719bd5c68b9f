// Listens to the microphone: loudness, clipping, noise, and when a sentence is over.

const kClipped = 0.985, kSpeechOverNoise = 12, kLoudRoom = -42, kFaint = -38, kSoftest = -50;  // full scale; dB

export class Ears {
  constructor(stream) {
    const context = new AudioContext();
    this.analyser = context.createAnalyser();
    this.analyser.fftSize = 2048;
    context.createMediaStreamSource(stream).connect(this.analyser);
    this.samples = new Float32Array(this.analyser.fftSize);
    this.level = -90;
    this.noise = null;  // dB, of the quiet moments
    this.isClipped = false;
    this.clippedAt = -1e9;
    this.loudest = -90;
    this.lastSpeech = null;
    setInterval(() => this.listen(), 40);
  }

  listen() {
    this.analyser.getFloatTimeDomainData(this.samples);
    let power = 0, peak = 0;
    for (const sample of this.samples) {
      power += sample * sample;
      peak = Math.max(peak, Math.abs(sample));
    }
    this.level = 10 * Math.log10(power / this.samples.length + 1e-9);
    const now = performance.now();
    if (peak >= kClipped) this.clippedAt = now;
    this.isClipped = now - this.clippedAt < 1500;
    // The noise follows quiet moments at once and loud ones slowly.
    if (this.noise === null || this.level < this.noise) this.noise = this.level;
    else this.noise += 0.01 * Math.min(3, this.level - this.noise);
    // Behind a noise gate a room is silent, and the least rustle would be speech.
    if (this.level > Math.max(this.noise + kSpeechOverNoise, kSoftest)) this.lastSpeech = now;
    this.loudest = Math.max(this.loudest - 0.05, this.level);
  }

  beginTake() {
    this.lastSpeech = null;
    this.loudest = -90;
  }

  /** Seconds since the speech of this take ended; 0 before it. */
  quietAfterSpeech() {
    return this.lastSpeech === null ? 0 : (performance.now() - this.lastSpeech) / 1000;
  }

  share() {
    return Math.max(0, Math.min(100, (100 * (this.level + 60)) / 60));
  }

  advice(isTaking) {
    const lines = [];
    if (this.isClipped) lines.push('The sound is clipped: turn the microphone down.');
    if (this.noise > kLoudRoom) lines.push('The room is loud: shut windows, stop fans, or come closer to the microphone.');
    if (isTaking && this.lastSpeech !== null && this.loudest < kFaint) lines.push('You are hardly heard: speak up, or come closer.');
    return lines;
  }
}
