//! Products, colours and the frame of the file.

use std::fmt::Write;

use crate::geometry::{LengthUnit, Surface};
use crate::model::brep::build::Model;
use crate::segment::Region;

use super::file::{Entities, Id, list, real, string};
use super::unit::{length_unit, said};

/// Distances up to this, in the file's unit, are nought to a reader: edges where surfaces run smoothly into each other leave either by
/// the error of their fit.
const UNCERTAINTY: &str = "1.E-5";

/// What a region is called: its number, type, size, and how exactly that is known.
pub fn face_name(region: &Region) -> String {
    let mut name = format!("region {} {}", region.id, region.surface_type.name());
    let deviation = |key: &str| region.uncertainty.as_ref()?.get(key)?.as_f64();
    let mut size = |what: &str, value: f64, key: &str| {
        // Writing into a string does not fail.
        let _ = write!(name, " {what} {value:.6}");
        if let Some(sd) = deviation(key) {
            let _ = write!(name, " sd {sd:.1e}");
        }
    };
    match &region.surface {
        Some(Surface::Sphere(s)) => size("radius", s.radius, "radius"),
        Some(Surface::Cylinder(s)) => size("radius", s.radius, "radius"),
        Some(Surface::Cone(s)) => size("half angle", s.half_angle, "half_angle"),
        Some(Surface::Torus(s)) => {
            size("major radius", s.major_radius, "major_radius");
            size("minor radius", s.minor_radius, "minor_radius");
        }
        _ => {}
    }
    name
}

/// What a shell is called: a solid, or its regions.
pub fn name(model: &Model, regions: &[Region], shell: usize) -> String {
    let shell_of = &model.shells[shell];
    let mut own: Vec<usize> = shell_of.faces.iter().map(|&f| model.faces[f].region).collect();
    own.dedup();
    match own[..] {
        [region] => face_name(&regions[region]),
        _ if shell_of.closed => format!("solid {shell}"),
        _ => format!("open shell {shell}"),
    }
}

/// What there is to say of a shell: which of its borders are open.
fn description(model: &Model, shell: usize) -> String {
    let shell_of = &model.shells[shell];
    if shell_of.closed {
        return "closed: every edge lies between two faces".into();
    }
    let open: Vec<String> = shell_of.open.iter().map(ToString::to_string).collect();
    let mut text = format!("open: borders without a neighbour at region {}", open.join(", "));
    for (region, why) in &model.apart {
        if shell_of.open.contains(region) {
            let _ = write!(text, "; region {region} shares no edge, as {why}");
        }
    }
    text
}

/// What was written for a part's shells.
pub struct Written {
    /// All entities.
    pub out: Entities,
    /// Each face with its region.
    pub faces: Vec<(Id, usize)>,
    /// Each shell's place in the model, and the item that stands for it.
    pub items: Vec<(usize, Id)>,
}

/// The whole file.
pub fn file(
    mut bodies: Written,
    model: &Model,
    regions: &[Region],
    unit: Option<LengthUnit>,
    version: &str,
    color: impl Fn(i32) -> [u8; 3],
) -> String {
    let context = context(&mut bodies.out, unit.unwrap_or(LengthUnit::Mm));
    let items = std::mem::take(&mut bodies.items);
    for (shell, item) in &items {
        let (name, description) = (name(model, regions, *shell), description(model, *shell));
        product(
            &mut bodies.out,
            &context,
            *item,
            model.shells[*shell].closed,
            [&name, &description],
        );
    }
    let faces = std::mem::take(&mut bodies.faces);
    let styled: Vec<Id> = faces
        .iter()
        .map(|(face, region)| styled(&mut bodies.out, *face, color(*region as i32)))
        .collect();
    if !styled.is_empty() {
        bodies.out.add(&format!(
            "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{},{})",
            list(styled),
            context.geometry
        ));
    }
    let solids = items.iter().filter(|(s, _)| model.shells[*s].closed).count();
    let summary = format!(
        "{} regions: {solids} closed solids, {} open shells; {}",
        regions.len(),
        items.len() - solids,
        said(unit)
    );
    let missing: Vec<String> = regions
        .iter()
        .filter(|r| !faces.iter().any(|(_, region)| *region == r.id))
        .map(|r| r.id.to_string())
        .collect();
    let missing = match missing.is_empty() {
        true => String::new(),
        false => format!(",{}", string(&format!("regions without a face: {}", missing.join(", ")))),
    };
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(({}{missing}),'2;1');\nFILE_NAME('','',(''),(''),{},{},'');\n\
         FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF {{ 1 0 10303 442 3 1 4 }}'));\nENDSEC;\nDATA;\n{}ENDSEC;\n\
         END-ISO-10303-21;\n",
        string(&summary),
        string(&format!("conicoid {version}")),
        string(&format!("conicoid {version}")),
        bodies.out.text()
    )
}

/// What all products share.
struct Context {
    geometry: Id,
    product: Id,
    definition: Id,
}

fn context(out: &mut Entities, unit: LengthUnit) -> Context {
    let application = out.add("APPLICATION_CONTEXT('managed model based 3d engineering')");
    out.add(&format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','ap242_managed_model_based_3d_engineering',2020,\
         {application})"
    ));
    let product = out.add(&format!("PRODUCT_CONTEXT('',{application},'mechanical')"));
    let definition =
        out.add(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')"));
    let length = length_unit(out, unit);
    let angle = out.add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))");
    let solid = out.add("(NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT())");
    let uncertainty = out.add(&format!(
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({UNCERTAINTY}),{length},'distance_accuracy_value','')"
    ));
    let geometry = out.add(&format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({uncertainty})) \
         GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid})) REPRESENTATION_CONTEXT('','3D'))"
    ));
    Context { geometry, product, definition }
}

fn product(
    out: &mut Entities,
    context: &Context,
    item: Id,
    closed: bool,
    [name, description]: [&str; 2],
) {
    let (name, description) = (string(name), string(description));
    let product = out.add(&format!("PRODUCT({name},{name},{description},({}))", context.product));
    out.add(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"));
    let formation = out.add(&format!("PRODUCT_DEFINITION_FORMATION('','',{product})"));
    let definition =
        out.add(&format!("PRODUCT_DEFINITION('design','',{formation},{})", context.definition));
    let shape = out.add(&format!("PRODUCT_DEFINITION_SHAPE('','',{definition})"));
    let origin = {
        let o = crate::geometry::Vec3::zeros();
        out.placement(&o, &crate::geometry::Vec3::z(), &crate::geometry::Vec3::x())
    };
    let kind = if closed {
        "ADVANCED_BREP_SHAPE_REPRESENTATION"
    } else {
        "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"
    };
    let representation = out.add(&format!("{kind}({name},({origin},{item}),{})", context.geometry));
    out.add(&format!("SHAPE_DEFINITION_REPRESENTATION({shape},{representation})"));
}

fn styled(out: &mut Entities, face: Id, rgb: [u8; 3]) -> Id {
    let [r, g, b] = rgb.map(|c| real(f64::from(c) / 255.0));
    let color = out.add(&format!("COLOUR_RGB('',{r},{g},{b})"));
    let fill = out.add(&format!("FILL_AREA_STYLE_COLOUR('',{color})"));
    let area = out.add(&format!("FILL_AREA_STYLE('',({fill}))"));
    let area = out.add(&format!("SURFACE_STYLE_FILL_AREA({area})"));
    let side = out.add(&format!("SURFACE_SIDE_STYLE('',({area}))"));
    let usage = out.add(&format!("SURFACE_STYLE_USAGE(.BOTH.,{side})"));
    let style = out.add(&format!("PRESENTATION_STYLE_ASSIGNMENT(({usage}))"));
    out.add(&format!("STYLED_ITEM('color',({style}),{face})"))
}
