//! Which cells are asked for.

use conicoid::fit::feature::FeatureType;

use crate::draw::{Cell, Sampling};
use crate::noise::Noise;

/// What the command line asks for.
pub struct Arguments {
    kinds: Vec<FeatureType>,
    arcs: Vec<f64>,
    sigmas: Vec<f64>,
    counts: Vec<usize>,
    noises: Vec<Noise>,
    samplings: Vec<Sampling>,
    /// Draws of a cell.
    pub draws: u64,
    /// Where their random numbers begin.
    pub seed: u64,
}

impl Arguments {
    /// Those of `KEY=VALUE,VALUE` words.
    pub fn read(words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut all = Self {
            kinds: FeatureType::ALL.to_vec(),
            arcs: vec![360.0, 180.0, 90.0, 60.0, 30.0],
            sigmas: vec![0.0005, 0.002, 0.01],
            counts: vec![1000],
            noises: Noise::ALL.to_vec(),
            samplings: Sampling::ALL.to_vec(),
            draws: 100,
            seed: 1,
        };
        for word in words {
            let (key, value) = word.split_once('=').ok_or(format!("{word}: give KEY=VALUE"))?;
            match key {
                "type" => all.kinds = list(value, FeatureType::from_name)?,
                "arc" => all.arcs = list(value, |v| v.parse().ok())?,
                "sigma" => all.sigmas = list(value, |v| v.parse().ok())?,
                "n" => all.counts = list(value, |v| v.parse().ok())?,
                "noise" => all.noises = list(value, Noise::from_name)?,
                "sampling" => all.samplings = list(value, Sampling::from_name)?,
                "draws" => all.draws = value.parse().map_err(|_| format!("{word}: a number"))?,
                "seed" => all.seed = value.parse().map_err(|_| format!("{word}: a number"))?,
                _ => return Err(format!("{key}: there is no such key")),
            }
        }
        Ok(all)
    }

    /// All cells, type by type.
    pub fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for &kind in &self.kinds {
            let is_whole = matches!(kind, FeatureType::Plane | FeatureType::Line);
            let arcs = if is_whole { &[360.0][..] } else { &self.arcs };
            for &noise in &self.noises {
                for &arc in arcs {
                    for &sigma in &self.sigmas {
                        for &n in &self.counts {
                            let cell = |&sampling| Cell { kind, arc, sigma, n, noise, sampling };
                            cells.extend(self.samplings.iter().map(cell));
                        }
                    }
                }
            }
        }
        cells
    }
}

fn list<T>(value: &str, parse: impl Fn(&str) -> Option<T>) -> Result<Vec<T>, String> {
    value.split(',').map(|v| parse(v).ok_or(format!("{v}: there is no such value"))).collect()
}
