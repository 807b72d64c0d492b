use super::FormatError;
use crate::geometry::Vec3;

/// An empty list with room for `points` that the input is known to be able to hold.
///
/// # Errors
/// The system has not that much memory.
pub(super) fn room_for<T>(points: u64) -> Result<Vec<T>, FormatError> {
    let mut list = Vec::new();
    let room = usize::try_from(points).ok().map(|points| list.try_reserve_exact(points));
    match room {
        Some(Ok(())) => Ok(list),
        _ => Err(FormatError::OutOfMemory { points }),
    }
}

/// That many points at the origin, to be filled.
///
/// # Errors
/// The system has not that much memory.
pub(super) fn zeros(points: u64) -> Result<Vec<Vec3>, FormatError> {
    let mut list = room_for(points)?;
    list.resize(list.capacity().min(points as usize), Vec3::zeros());
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_that_no_system_has_is_an_error() {
        let points = u64::MAX / 1024;
        assert_eq!(room_for::<[f64; 3]>(points), Err(FormatError::OutOfMemory { points }));
        assert_eq!(room_for::<[f64; 3]>(7).unwrap().capacity(), 7);
    }
}
