//! The schemas as generators of clients take them.

use std::collections::BTreeMap;

use utoipa::openapi::{
    AllOfBuilder, Components, KnownFormat, Object, RefOr, Schema, SchemaFormat, Type,
    schema::{AdditionalProperties, ArrayItems, Discriminator, ObjectBuilder, SchemaType},
};

use crate::geometry::SurfaceType;

/// The field that tells one surface from another.
const KIND: &str = "type";

/// Gives surfaces the field that tells them apart, choices that are of no other choices, words of no `$ref` a place of their own,
/// and whole numbers a size.
pub fn complete(components: &mut Components) {
    tell_apart(components);
    flatten(components);
    components.schemas.values_mut().for_each(tidy);
}

/// A surface says which it is: generators choose its class by that.
fn tell_apart(components: &mut Components) {
    let names = SurfaceType::DEFAULT.map(|kind| (kind.name(), class(kind.name())));
    for (name, class) in &names {
        let Some(RefOr::T(Schema::Object(object))) = components.schemas.get_mut(class) else {
            continue;
        };
        let kind = ObjectBuilder::new().schema_type(Type::String).enum_values(Some([*name]));
        let kind = kind.description(Some("Which surface it is"));
        object.properties.insert(KIND.to_owned(), kind.into());
        object.required.insert(0, KIND.to_owned());
    }
    if let Some(RefOr::T(Schema::OneOf(surface))) = components.schemas.get_mut("Surface") {
        let mapping = names.iter().map(|(name, class)| ((*name).to_owned(), place(class)));
        surface.discriminator = Some(Discriminator::with_mapping(KIND, mapping));
    }
}

/// A choice that has another among its own has the other's: generators make no class of a choice that could be asked for.
fn flatten(components: &mut Components) {
    let choice = |schema: &RefOr<Schema>| match schema {
        RefOr::T(Schema::OneOf(one)) => Some(one.items.clone()),
        _ => None,
    };
    let named = components.schemas.iter();
    let choices: BTreeMap<String, Vec<_>> =
        named.filter_map(|(name, schema)| Some((place(name), choice(schema)?))).collect();
    for schema in components.schemas.values_mut() {
        let RefOr::T(Schema::OneOf(one)) = schema else { continue };
        let flat = one.items.drain(..).flat_map(|item| match &item {
            RefOr::Ref(of) => choices.get(&of.ref_location).cloned().unwrap_or(vec![item]),
            RefOr::T(_) => vec![item],
        });
        one.items = flat.collect();
    }
}

/// Where a schema of that name stands.
fn place(name: &str) -> String {
    format!("#/components/schemas/{name}")
}

/// The name of a type as that of its schema: `elliptic_cylinder` is `EllipticCylinder`.
fn class(name: &str) -> String {
    let capital = |word: &str| word[..1].to_ascii_uppercase() + &word[1..];
    name.split('_').map(capital).collect()
}

/// Nothing stands beside a `$ref`, which older readers take as the whole schema.
pub fn tidy(schema: &mut RefOr<Schema>) {
    match schema {
        RefOr::Ref(reference) => {
            let words = std::mem::take(&mut reference.description);
            if !words.is_empty() {
                let only = AllOfBuilder::new().item(reference.clone()).description(Some(words));
                *schema = RefOr::T(only.into());
            }
        }
        RefOr::T(schema) => tidy_schema(schema),
    }
}

fn tidy_schema(schema: &mut Schema) {
    match schema {
        Schema::Object(object) => tidy_object(object),
        Schema::Array(array) => {
            if let ArrayItems::RefOrSchema(items) = &mut array.items {
                tidy(items);
            }
        }
        Schema::OneOf(one) => tidy_choice(&mut one.items, &mut one.description),
        Schema::AllOf(all) => tidy_choice(&mut all.items, &mut all.description),
        Schema::AnyOf(any) => tidy_choice(&mut any.items, &mut any.description),
        _ => {}
    }
}

/// The words of the one reference of a choice are those of the choice.
fn tidy_choice(items: &mut [RefOr<Schema>], words: &mut Option<String>) {
    for item in items {
        match item {
            RefOr::Ref(reference) => {
                let own = std::mem::take(&mut reference.description);
                if !own.is_empty() {
                    words.get_or_insert(own);
                }
            }
            other => tidy(other),
        }
    }
}

fn tidy_object(object: &mut Object) {
    object.properties.values_mut().for_each(tidy);
    if let Some(more) = &mut object.additional_properties
        && let AdditionalProperties::RefOr(schema) = &mut **more
    {
        tidy(schema);
    }
    // without a size, Java and C# take 32 bits
    let whole = match &object.schema_type {
        SchemaType::Type(kind) => *kind == Type::Integer,
        SchemaType::Array(kinds) => kinds.contains(&Type::Integer),
        SchemaType::AnyValue => false,
    };
    if whole && object.format.is_none() {
        object.format = Some(SchemaFormat::KnownFormat(KnownFormat::Int64));
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn every_surface_has_its_schema_by_its_name() {
        let openapi = super::super::super::openapi();
        let schemas = openapi.components.unwrap().schemas;
        let told = json!(schemas);
        for kind in SurfaceType::DEFAULT {
            let class = class(kind.name());
            assert_eq!(told[&class]["properties"][KIND]["enum"], json!([kind.name()]), "{class}");
            assert_eq!(told["Surface"]["discriminator"]["mapping"][kind.name()], place(&class));
        }
    }
}
