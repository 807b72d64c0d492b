use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{
    super::{Input, ThinInput},
    document::{FitDocument, FitParameters},
    request::FitRequest,
    told::fit_cloud,
};
use crate::{
    fit::feature::{Association, FeatureType},
    geometry::PointCloud,
    segment::Region,
};

/// The feature of a region's points: what a fit to them alone gives, to the last bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RegionFit {
    /// The region.
    pub region: usize,
    /// The feature. Its `input` counts the region's points; its `rejected` and `certificate` name places in the whole input.
    /// Null where there is none.
    pub fit: Option<FitDocument>,
    /// Why there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// The features of all regions, each of its region's type and points.
pub fn region_fits(
    cloud: &PointCloud,
    labels: &[i32],
    regions: &[Region],
    association: Association,
    input: &Input,
) -> Vec<RegionFit> {
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); regions.len()];
    for (i, &label) in labels.iter().enumerate() {
        if let Some(own) = usize::try_from(label).ok().and_then(|label| members.get_mut(label)) {
            own.push(i);
        }
    }
    let one = |(region, members): (&Region, &Vec<usize>)| {
        let name = region.surface_type.name();
        let Some(kind) = FeatureType::from_name(name) else {
            let refused = Some(format!("no feature is fitted to a region of type {name}"));
            return RegionFit { region: region.id, fit: None, refused };
        };
        let request = FitRequest {
            parameters: FitParameters {
                r#type: kind.name().to_owned(),
                association: association.name().to_owned(),
                ..FitParameters::default()
            },
            ..FitRequest::default()
        };
        let thin = input.thin.clone().map(|thin| ThinInput { kept: members.len(), ..thin });
        let input = Input { points: members.len(), skipped: 0, thin, ..input.clone() };
        match fit_cloud(&part(cloud, members), input, &request) {
            Ok(fit) => RegionFit { region: region.id, fit: Some(fit), refused: None },
            Err(error) => {
                RegionFit { region: region.id, fit: None, refused: Some(error.to_string()) }
            }
        }
    };
    regions.par_iter().zip(&members).map(one).collect()
}

/// Some of a cloud's points, with their places in the input.
fn part(cloud: &PointCloud, members: &[usize]) -> PointCloud {
    let place = |&i: &usize| cloud.input_index.as_ref().map_or(i as u32, |index| index[i]);
    PointCloud {
        points: members.iter().map(|&i| cloud.points[i]).collect(),
        input_index: Some(members.iter().map(place).collect()),
        input_len: cloud.input_len,
        ..PointCloud::default()
    }
}
