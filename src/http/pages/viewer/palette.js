// Which colour each region has, so that a surface keeps its own from one run to the next.

/// For each new region the old one that has most of its points, if that has most of its own there too; each old one
/// once. Both lists hold the labels of the same points.
export const matched = (before, after) => {
  const shared = new Map(), sizes = new Map();
  for (let k = 0; k < after.length; k++) {
    if (after[k] < 0) continue;
    sizes.set(after[k], (sizes.get(after[k]) || 0) + 1);
    if (before[k] < 0) continue;
    let row = shared.get(after[k]);
    if (!row) shared.set(after[k], row = new Map());
    row.set(before[k], (row.get(before[k]) || 0) + 1);
  }
  const pairs = [...shared].flatMap(([now, row]) => [...row].map(([old, points]) => ({ now, old, points })));
  pairs.sort((a, b) => b.points - a.points || a.now - b.now);
  const found = new Map(), taken = new Set();
  for (const { now, old, points } of pairs) {
    if (found.has(now) || taken.has(old) || 2 * points < sizes.get(now)) continue;
    found.set(now, old);
    taken.add(old);
  }
  return found;
};

/// The colours of the new regions: those of the regions before that they are, then those of the service that are free.
/// `own` are the service's of the new ones, all maps from a label to red, green and blue.
export const palette = (own, before, match) => {
  const colors = new Map([[-1, own.get(-1) || [128, 128, 128]]]);
  for (const [now, old] of match) if (before.has(old)) colors.set(now, before.get(old));
  const used = new Set([...colors.values()].map(String));
  const free = [...own.values(), ...before.values()].filter(color => !used.has(String(color)));
  for (const [label, color] of own) {
    if (colors.has(label)) continue;
    // its own where nobody has it, else another's that is free
    const chosen = used.has(String(color)) ? free.find(other => !used.has(String(other))) || color : color;
    used.add(String(chosen));
    colors.set(label, chosen);
  }
  return colors;
};
