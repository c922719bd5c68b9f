// The strip under the phones: the sound as a band, the opening of the lips as a line.

function peaksOf(samples, columns) {
  const peaks = new Float32Array(columns);
  const step = samples.length / columns;
  for (let column = 0; column < columns; ++column) {
    let peak = 0;
    for (let i = Math.floor(column * step); i < Math.floor((column + 1) * step); ++i) peak = Math.max(peak, Math.abs(samples[i]));
    peaks[column] = peak;
  }
  return peaks;
}

/** Draws into `canvas`, `width` x `height` CSS pixels for `duration` seconds. */
export function drawCurves(canvas, width, height, { sound, lipOpening, framesPerSecond, duration }) {
  // Beyond this many device pixels browsers stop drawing.
  const scale = Math.min(window.devicePixelRatio || 1, 16000 / width);
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const style = getComputedStyle(canvas);
  const context = canvas.getContext('2d');
  context.scale(scale, scale);

  const soundWidth = Math.round((width * sound.samples.length) / sound.sampleRate / duration);
  const peaks = peaksOf(sound.samples, Math.max(soundWidth, 1));
  const loudest = Math.max(...peaks, 1);
  context.fillStyle = style.getPropertyValue('--wave');
  peaks.forEach((peak, x) => {
    const half = Math.max(0.5, (peak / loudest) * (height / 2 - 3));
    context.fillRect(x, height / 2 - half, 1, 2 * half);
  });

  if (lipOpening.length < 2) return;
  const low = Math.min(...lipOpening);
  const high = Math.max(...lipOpening);
  const yOf = (value) => height - 5 - ((value - low) / Math.max(high - low, 1e-6)) * (height - 10);
  context.strokeStyle = style.getPropertyValue('--lips');
  context.lineWidth = 1.75;
  context.lineJoin = 'round';
  context.beginPath();
  lipOpening.forEach((value, frame) => context.lineTo((frame / framesPerSecond / duration) * width, yOf(value)));
  context.stroke();
}
