//! Forms with a cloud, and the parameters in them: named, for generators give what has no name one of their own.

use utoipa::openapi::{
    AllOfBuilder, KnownFormat, Ref, RefOr, Schema, SchemaFormat,
    schema::{AdditionalProperties, ObjectBuilder, Type},
};

use super::parameters::with_help;
use crate::segment::ParameterSpec;

/// What a form is called.
#[derive(Clone, Copy)]
pub struct CloudForm {
    /// The schema of the form.
    pub name: &'static str,
    /// The schema of its part `parameters`.
    parameters: &'static str,
    /// What the parameters are of.
    of: &'static str,
}

/// The form of a segmentation, or of a job that makes one.
pub const SEGMENTATION_FORM: CloudForm = CloudForm {
    name: "SegmentationForm",
    parameters: "SegmentationParameters",
    of: "segmentation",
};

/// The form of a fit.
pub const FIT_FORM: CloudForm =
    CloudForm { name: "FitForm", parameters: "FitFormParameters", of: "fit" };

impl CloudForm {
    /// The schemas of the form and of its parameters, which are those of the table.
    pub fn schemas(
        self,
        table: impl Iterator<Item = &'static ParameterSpec> + Clone,
    ) -> [(&'static str, Schema); 2] {
        let parameters = RefOr::T(
            AllOfBuilder::new()
                .item(Ref::from_schema_name(self.parameters))
                .description(Some(
                    "All parameters in one; each has one value, here or in the part of its name",
                ))
                .into(),
        );
        let form = closed("A cloud and what to do with it")
            .property("cloud", binary("The file's bytes; its name may tell the format"))
            .property("parameters", parameters)
            .required("cloud");
        let all =
            closed(&format!("The parameters of a {}; each absent one takes its default", self.of));
        let with = |object: ObjectBuilder| {
            table.clone().fold(object, |object, spec| object.property(spec.name, with_help(spec)))
        };
        // each is a part of its own as well: some generators write objects in forms in no form at all
        [(self.name, with(form).into()), (self.parameters, with(all).into())]
    }
}

/// An object of no other fields than those named.
fn closed(help: &str) -> ObjectBuilder {
    ObjectBuilder::new()
        .additional_properties(Some(AdditionalProperties::FreeForm(false)))
        .description(Some(help))
}

/// The bytes of a file.
pub fn binary(help: &str) -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
        .description(Some(help))
}
