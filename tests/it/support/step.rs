//! A reader of STEP files that knows nothing of how they are written: what it says follows from the text alone.

use std::collections::BTreeMap;

use conicoid::geometry::Vec3;

/// A parameter of an entity.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Ref(usize),
    Number(f64),
    Text(String),
    Enum(String),
    List(Vec<Value>),
    Other,
}

impl Value {
    pub fn id(&self) -> usize {
        let Value::Ref(id) = self else { panic!("{self:?} is no reference") };
        *id
    }

    pub fn number(&self) -> f64 {
        let Value::Number(x) = self else { panic!("{self:?} is no number") };
        *x
    }

    pub fn list(&self) -> &[Value] {
        let Value::List(all) = self else { panic!("{self:?} is no list") };
        all
    }

    pub fn text(&self) -> &str {
        let Value::Text(text) = self else { panic!("{self:?} is no text") };
        text
    }

    pub fn is_true(&self) -> bool {
        *self == Value::Enum("T".into())
    }
}

/// An entity: its name and parameters; the complex ones have no name here.
pub type Entity = (String, Vec<Value>);

/// The entities of a file.
pub struct File {
    pub header: String,
    pub all: BTreeMap<usize, Entity>,
}

/// Parameters from behind an opening bracket to the closing one.
fn values(text: &[u8], at: &mut usize) -> Vec<Value> {
    let mut out = Vec::new();
    while *at < text.len() {
        let c = text[*at];
        *at += 1;
        match c {
            b')' => break,
            b',' | b' ' => {}
            b'(' => out.push(Value::List(values(text, at))),
            b'\'' => {
                let from = *at;
                while text[*at] != b'\'' || text.get(*at + 1) == Some(&b'\'') {
                    *at += if text[*at] == b'\'' { 2 } else { 1 };
                }
                out.push(Value::Text(String::from_utf8_lossy(&text[from..*at]).replace("''", "'")));
                *at += 1;
            }
            _ => {
                let from = *at - 1;
                while !b",() ".contains(&text[*at]) {
                    *at += 1;
                }
                let word = String::from_utf8_lossy(&text[from..*at]).into_owned();
                out.push(match (c, word.parse()) {
                    (b'#', _) => Value::Ref(word[1..].parse().unwrap()),
                    (b'.', Err(_)) => Value::Enum(word.trim_matches('.').into()),
                    (_, Ok(x)) => Value::Number(x),
                    _ => Value::Other,
                });
            }
        }
    }
    out
}

impl File {
    pub fn read(text: &str) -> Self {
        let (header, data) = text.split_once("DATA;\n").unwrap();
        let mut all = BTreeMap::new();
        for line in data.lines().filter(|l| l.starts_with('#')) {
            let (id, entity) = line[1..].trim_end_matches(';').split_once('=').unwrap();
            let (name, rest) = entity.split_once('(').unwrap();
            let parameters = values(rest.as_bytes(), &mut 0);
            assert!(all.insert(id.parse().unwrap(), (name.to_owned(), parameters)).is_none());
        }
        for (name, parameters) in all.values() {
            parameters.iter().for_each(|p| Self::check_references(p, &all, name));
        }
        Self { header: header.into(), all }
    }

    fn check_references(value: &Value, all: &BTreeMap<usize, Entity>, name: &str) {
        match value {
            Value::Ref(id) => assert!(all.contains_key(id), "{name} refers to #{id}"),
            Value::List(list) => list.iter().for_each(|v| Self::check_references(v, all, name)),
            _ => {}
        }
    }

    pub fn named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = (usize, &'a [Value])> {
        self.all.iter().filter(move |(_, e)| e.0 == name).map(|(id, e)| (*id, &e.1[..]))
    }

    /// The parameters of an entity of that name.
    pub fn get(&self, id: usize, name: &str) -> &[Value] {
        let (own, parameters) = &self.all[&id];
        assert_eq!(own, name, "#{id}");
        parameters
    }

    pub fn vector(&self, id: usize) -> Vec3 {
        let (name, parameters) = &self.all[&id];
        assert!(["CARTESIAN_POINT", "DIRECTION"].contains(&name.as_str()), "#{id} is a {name}");
        let x: Vec<f64> = parameters[1].list().iter().map(Value::number).collect();
        Vec3::new(x[0], x[1], x[2])
    }

    /// Origin and axes x, y, z of a placement.
    pub fn placement(&self, id: usize) -> (Vec3, [Vec3; 3]) {
        let p = self.get(id, "AXIS2_PLACEMENT_3D");
        let [o, z, x] = [1, 2, 3].map(|k| self.vector(p[k].id()));
        assert!(
            x.dot(&z).abs() < 1e-12
                && (x.norm() - 1.0).abs() < 1e-12
                && (z.norm() - 1.0).abs() < 1e-12
        );
        (o, [x, z.cross(&x), z])
    }

    pub fn vertex(&self, id: usize) -> Vec3 {
        self.vector(self.get(id, "VERTEX_POINT")[1].id())
    }
}
