// A colour for every take, and which take each phone came from.

/** Golden angle: any two takes that follow each other are far apart in hue. */
const HUE_STEP_DEG = 137.508;
const FIRST_HUE_DEG = 205;

/** What a unit was taken from; no take: curves are drawn. */
export const nameOf = (take) => take || 'curves';

export class Takes {
  constructor(report) {
    this.report = report;
    this.entries = new Map();
    for (const unit of report.units) {
      if (!this.entries.has(unit.take)) {
        const hue = (FIRST_HUE_DEG + HUE_STEP_DEG * this.entries.size) % 360;
        this.entries.set(unit.take, { take: unit.take, color: `oklch(0.8 0.105 ${hue.toFixed(1)})`, units: 0, seconds: 0 });
      }
      const entry = this.entries.get(unit.take);
      entry.units += 1;
      entry.seconds += unit.end_s - unit.start_s;
    }
  }

  colorOf(take) {
    return this.entries.get(take)?.color ?? 'var(--rest)';
  }

  /** Units that hold the phone, in time order: two where they are joined in it. */
  unitsOf(phone) {
    return this.report.units.filter((unit) => unit.first <= phone && phone <= unit.last);
  }

  /** CSS background of a phone's block: its take's colour, or two that meet at the join. */
  backgroundOf(phone) {
    const units = this.unitsOf(phone);
    if (units.length === 0) return 'var(--rest)';
    const colors = units.map((unit) => this.colorOf(unit.take));
    if (new Set(colors).size === 1) return colors[0];
    const { start_s: start, end_s: end } = this.report.phones[phone];
    const join = this.report.joins.find(({ time_s: time }) => start <= time && time <= end)?.time_s ?? (start + end) / 2;
    const percent = ((100 * (join - start)) / Math.max(end - start, 1e-6)).toFixed(1);
    return `linear-gradient(90deg, ${colors[0]} ${percent}%, ${colors[colors.length - 1]} ${percent}%)`;
  }
}
