//! Points of a scene in a row, and the labels that they meet.

use rayon::prelude::*;

use crate::segment::prepare::scene::Scene;

/// Points of a block: fixed, so that the result does not depend on the number of threads.
pub const BLOCK: usize = 128;

/// Points in a row.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// The labels met by its points, their own and their neighbours'.
    pub met: Vec<i32>,
    /// Pairs of labels that meet along a border, the lower first, and how many graph edges cross it.
    pub pairs: Vec<([i32; 2], usize)>,
}

impl Block {
    /// Adds a point with a label and those of its neighbours.
    pub fn add(&mut self, own: i32, near: impl Iterator<Item = i32>) {
        let mut last = -1;
        for l in near.chain([own]) {
            // mostly one after the other are the same
            if l != last && l >= 0 && !self.met.contains(&l) {
                self.met.push(l);
            }
            last = l;
            if l >= 0 && own >= 0 && l != own {
                let pair = [l.min(own), l.max(own)];
                match self.pairs.iter_mut().find(|p| p.0 == pair) {
                    Some(p) => p.1 += 1,
                    None => self.pairs.push((pair, 1)),
                }
            }
        }
    }
}

/// The blocks with neighbours in each block of a scene, itself among them. To be near is not mutual: a point of a sparse
/// place has neighbours in a dense one that it is none of.
pub fn blocks_beside(scene: &Scene) -> Vec<Vec<u32>> {
    let blocks = scene.len().div_ceil(BLOCK);
    let met: Vec<Vec<u32>> = (0..blocks)
        .into_par_iter()
        .map(|b| {
            let mut met = vec![b as u32];
            for i in b * BLOCK..scene.len().min((b + 1) * BLOCK) {
                for &j in scene.neighbours(i) {
                    let other = j / BLOCK as u32;
                    if met.last() != Some(&other) && !met.contains(&other) {
                        met.push(other);
                    }
                }
            }
            met
        })
        .collect();
    let mut beside = vec![Vec::new(); blocks];
    for (b, met) in met.into_iter().enumerate() {
        met.into_iter().for_each(|other| beside[other as usize].push(b as u32));
    }
    beside
}
