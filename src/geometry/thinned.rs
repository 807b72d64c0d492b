/// How a cloud was thinned: its points are those that were kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thinned {
    /// The least distance of kept points from each other.
    pub length: f64,
    /// Points of the input with three finite coordinates that are no holes, kept or not.
    pub finite: usize,
    /// For each input point, the place among the kept points of the one nearest to it; [`Thinned::NONE`] for points left
    /// out.
    pub nearest: Vec<u32>,
}

impl Thinned {
    /// Stands for no point.
    pub const NONE: u32 = u32::MAX;

    /// What the kept points have, for each input point; `none` for points left out.
    pub fn spread<T: Copy>(&self, kept: &[T], none: T) -> Vec<T> {
        self.nearest.iter().map(|&k| kept.get(k as usize).copied().unwrap_or(none)).collect()
    }
}
