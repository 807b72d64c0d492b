//! Rows, pooled figures, and what misses the targets.

use std::collections::BTreeMap;

use crate::draw::Cell;
use crate::score::{Component, GROUPS, Score, parameters};

/// Error over uncertainty in each cell, and coverage.
const RATIO: (f64, f64) = (0.9, 1.1);
const COVERED: (f64, f64) = (0.93, 0.97);
/// Fewest draws that tell for a cell to be judged, and counted in pooled figures.
const JUDGED: f64 = 20.0;

/// Figures of one group of parameters, or of several pooled; sums weighed by draws that told.
#[derive(Clone, Copy, Debug, Default)]
struct Figures {
    draws: f64,
    told: f64,
    held: f64,
    sq_ratio: f64,
}

impl Figures {
    /// Of the components of one cell: shares told of each, and the mean over them of squared errors over squared uncertainties.
    fn of(components: &[&Component], count: usize, draws: usize) -> Self {
        let mut own: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        let (mut held, mut of) = (0.0, 0.0);
        for c in components {
            let sums = own.entry(c.own).or_default();
            sums.0 += c.error * c.error;
            sums.1 += c.standard * c.standard;
            held += f64::from(u8::from(c.error.abs() <= c.expanded));
            of += 1.0;
        }
        let told = of / count as f64;
        let ratio: f64 = own.values().map(|(e, u)| e / u).sum::<f64>() / own.len().max(1) as f64;
        let held = if of > 0.0 { held / of } else { 0.0 };
        Self { draws: draws as f64, told, held: told * held, sq_ratio: told * ratio }
    }

    /// Counts a cell in; where so few draws told that it is not judged, its draws alone.
    fn add(&mut self, other: &Self) {
        self.draws += other.draws;
        if other.told < JUDGED {
            return;
        }
        self.told += other.told;
        self.held += other.held;
        self.sq_ratio += other.sq_ratio;
    }

    fn covered(&self) -> f64 {
        self.held / self.told
    }

    fn ratio(&self) -> f64 {
        (self.sq_ratio / self.told).sqrt()
    }

    /// Whether it is outside the targets by more than two standard errors.
    fn misses(&self) -> bool {
        if self.told < JUDGED {
            return false;
        }
        let slack = 2.0 / (2.0 * self.told).sqrt() * self.ratio();
        let is_ratio_off = self.ratio() + slack < RATIO.0 || self.ratio() - slack > RATIO.1;
        let slack = 2.0 * (0.0455 * 0.9545 / self.told).sqrt();
        let covered = self.covered();
        is_ratio_off || covered + slack < COVERED.0 || covered - slack > COVERED.1
    }

    fn text(&self) -> String {
        if self.draws == 0.0 {
            return format!("{:>17}", "-");
        }
        let told = 100.0 * self.told / self.draws;
        if self.told == 0.0 {
            return format!("{told:>4.0} {:>6} {:>5}", "-", "-");
        }
        format!("{told:>4.0} {:>6.1} {:>5.2}", 100.0 * self.covered(), self.ratio())
    }
}

/// All cells that were drawn.
#[derive(Default)]
pub struct Table {
    /// By type and noise.
    pooled: BTreeMap<(&'static str, &'static str), [Figures; 3]>,
    by_noise: BTreeMap<&'static str, [Figures; 3]>,
    missing: Vec<String>,
    judged: usize,
}

/// The heading of the rows.
pub fn head() {
    let groups: Vec<String> = GROUPS.iter().map(|g| format!("{g:>17}")).collect();
    println!("{:<62}{}", "", groups.join(" |"));
    println!(
        "{:<17} {:>4} {:>7} {:>6} {:<10} {:<4} {:>6}   {}",
        "type",
        "arc",
        "sigma/R",
        "n",
        "noise",
        "how",
        "draws",
        ["told  cover  e/u "; 3].join(" | ")
    );
}

impl Table {
    /// Prints the row of a cell, and counts it in.
    pub fn add(&mut self, cell: &Cell, scores: &[Score]) {
        let mut all = [Figures::default(); 3];
        for (group, figures) in all.iter_mut().enumerate() {
            let of_group = parameters(cell.kind).iter().filter(|p| p.1 == group);
            let count: usize = of_group.map(|p| p.2).sum();
            if count > 0 {
                let components = scores.iter().flat_map(|s| &s.0).filter(|c| c.group == group);
                let components: Vec<&Component> = components.collect();
                *figures = Figures::of(&components, count, scores.len());
            }
        }
        let (kind, noise) = (cell.kind.name(), cell.noise.name());
        for (group, figures) in all.iter().enumerate() {
            self.pooled.entry((kind, noise)).or_default()[group].add(figures);
            self.by_noise.entry(noise).or_default()[group].add(figures);
        }
        let row = format!(
            "{kind:<17} {:>4} {:>7} {:>6} {noise:<10} {:<4} {:>6}   {}",
            cell.arc,
            cell.sigma,
            cell.n,
            cell.sampling.name(),
            scores.len(),
            all.map(|f| f.text()).join(" | ")
        );
        println!("{row}");
        self.judged += all.iter().filter(|f| f.told >= JUDGED).count();
        for (group, figures) in all.iter().enumerate().filter(|(_, f)| f.misses()) {
            let (covered, ratio) = (100.0 * figures.covered(), figures.ratio());
            let name = GROUPS[group];
            self.missing.push(format!("{}  {name}: {covered:.1} %, {ratio:.2}", &row[..60]));
        }
    }

    /// Prints what is pooled, and what misses.
    pub fn print(&self) {
        println!("\nby type and noise");
        for ((kind, noise), all) in &self.pooled {
            println!("{kind:<17} {noise:<32}   {}", all.map(|f| f.text()).join(" | "));
        }
        println!("\nby noise");
        for (noise, all) in &self.by_noise {
            println!("{noise:<50}   {}", all.map(|f| f.text()).join(" | "));
        }
        println!(
            "\n{} of {} outside the targets by more than chance",
            self.missing.len(),
            self.judged
        );
        for row in &self.missing {
            println!("{row}");
        }
    }
}
