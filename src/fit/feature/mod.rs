//! One geometric feature through all given points, as metrology asks for it.
//!
//! Sources: ISO 10360-6 (tests of Gaussian associated features); A. B. Forbes, *Least-squares best-fit geometric
//! elements*, NPL report DITC 140/89; C. M. Shakarji, *Least-squares fitting algorithms of the NIST algorithm testing
//! system*, J. Res. NIST 103 (1998).
//!
//! - `starts`, `tori`: where fits begin, from points alone;
//! - `rows`, `foot`: distances and their derivatives, to machine accuracy;
//! - `descend`, `gauss`: orthogonal least squares;
//! - `assess`: a feature with all that is known of it (`exactness`, `lobes` and `count`, `together`, `profile`, `terms`, `condition`, `student`);
//! - `exchange`, `zone`, `settle`, `ties`, `extreme`: minimum zones, circumscribed and inscribed features;
//! - `noise`, `reach`: how far noise reaches, and how exactly such features are known;
//! - `auto`: which type points are of.

mod asked;
mod assess;
mod association;
mod auto;
mod condition;
mod count;
mod descend;
mod element;
mod error;
mod exactness;
mod exchange;
mod extreme;
mod fixed;
mod foot;
mod gauss;
mod kasa;
mod kind;
mod lobes;
mod noise;
mod pose;
mod profile;
mod reach;
mod rows;
mod settle;
mod small;
mod starts;
mod student;
mod terms;
mod ties;
mod together;
mod tori;
#[cfg(test)]
mod trusted;
mod zone;

pub use asked::Asked;
pub use assess::{Feature, FormError, assess};
pub use association::Association;
pub use auto::simplest;
pub use condition::Condition;
pub use descend::Freedoms;
pub use element::{Circle, Element, Line};
pub use error::FitError;
pub use exactness::{Exactness, Parameter};
pub use extreme::extreme;
pub use fixed::Fixed;
pub use gauss::{Least, Local, least};
pub use kind::FeatureType;
pub use lobes::Lobes;
pub use noise::Noise;
pub use pose::Pose;
pub use profile::untold;
pub use rows::Gauge;
pub use zone::{Contact, Held};
