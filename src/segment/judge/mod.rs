//! Whether what was found is a surface: tests of whiteness, breadth, form and stability.

pub mod across;
pub mod breadth;
pub mod form;
pub mod one_quadric;
pub mod parabola;
pub mod scatter;
pub mod stability;
pub mod strays;
#[cfg(test)]
mod tests;
pub mod whiteness;
