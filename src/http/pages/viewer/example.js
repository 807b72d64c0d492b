// A cloud to try the page with.

/// A plate with a boss, a ball on it and a tapered stud, with noise of a hundredth, as text.
export const example = () => {
  let state = 1;
  const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
  const noise = () => 0.01 * Math.sqrt(-2 * Math.log(random())) * Math.cos(2 * Math.PI * random());
  const lines = [], add = (x, y, z, n) => {
    const e = noise();
    lines.push([x + e * n[0], y + e * n[1], z + e * n[2]].map(v => v.toFixed(4)).join(" "));
  };
  for (let i = 0; i < 16000; i++) {
    const [x, y] = [60 * random() - 30, 40 * random() - 20];
    if (Math.hypot(x + 14, y) > 8 && Math.hypot(x - 14, y) > 7) add(x, y, 0, [0, 0, 1]);
  }
  for (let i = 0; i < 9000; i++) {
    const t = 2 * Math.PI * random(), n = [Math.cos(t), Math.sin(t), 0];
    add(8 * n[0] - 14, 8 * n[1], 12 * random(), n);
  }
  for (let i = 0; i < 6000; i++) {
    const t = 2 * Math.PI * random(), z = random(), r = Math.sqrt(1 - z * z), n = [r * Math.cos(t), r * Math.sin(t), z];
    add(8 * n[0] - 14, 8 * n[1], 12 + 8 * n[2], n);
  }
  for (let i = 0; i < 8000; i++) {
    const t = 2 * Math.PI * random(), z = 14 * (1 - Math.sqrt(random())), r = 7 - z / 3;
    const n = [0.949 * Math.cos(t), 0.949 * Math.sin(t), 0.316];
    add(14 + r * Math.cos(t), r * Math.sin(t), z, n);
  }
  return new Blob([lines.join("\n")]);
};
