//! What is around the shapes: units, contexts, products, colours.
//!
//! Source: ISO 10303-41 (product description), 10303-46 (colours), CAx-IF Recommended Practices.

use glam::DVec3;

use super::entity::{Entities, Id, List, Quoted, Real};

/// The unit of length that one unit of the scene is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LengthUnit {
    /// Millimetres.
    #[default]
    Millimetre,
    /// Centimetres.
    Centimetre,
    /// Metres.
    Metre,
    /// Inches of 25.4 mm.
    Inch,
}

/// The application protocol: who is to read the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Schema {
    /// Configuration controlled 3D designs (ISO 10303-203).
    Ap203,
    /// Automotive design (ISO 10303-214).
    Ap214,
    /// Managed model-based 3D engineering (ISO 10303-242).
    #[default]
    Ap242,
}

impl LengthUnit {
    /// How long it is in millimetres.
    #[must_use]
    pub const fn millimetres(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1000.0,
            Self::Inch => 25.4,
        }
    }

    fn write(self, entities: &mut Entities) -> Id {
        let si = |entities: &mut Entities, prefix: &str| {
            entities.add(format_args!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))"))
        };
        match self {
            Self::Millimetre => si(entities, ".MILLI."),
            Self::Centimetre => si(entities, ".CENTI."),
            Self::Metre => si(entities, "$"),
            Self::Inch => {
                let millimetre = si(entities, ".MILLI.");
                let exponents = entities.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
                let factor = entities.add(format_args!(
                    "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{millimetre})",
                    Real(self.millimetres())
                ));
                entities.add(format_args!(
                    "(CONVERSION_BASED_UNIT('INCH',{factor})LENGTH_UNIT()NAMED_UNIT({exponents}))"
                ))
            }
        }
    }
}

impl Schema {
    /// Its name in the header.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ap203 => "CONFIG_CONTROL_DESIGN",
            Self::Ap214 => "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }",
            Self::Ap242 => "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 3 1 4 }",
        }
    }

    /// The application, the protocol's name and year.
    const fn protocol(self) -> (&'static str, &'static str, u32) {
        match self {
            Self::Ap203 => (
                "configuration controlled 3d designs of mechanical parts and assemblies",
                "config_control_design",
                1994,
            ),
            Self::Ap214 => {
                ("core data for automotive mechanical design processes", "automotive_design", 2000)
            }
            Self::Ap242 => {
                ("managed model based 3d engineering", "ap242_managed_model_based_3d_engineering", 2014)
            }
        }
    }
}

/// What all products share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contexts {
    schema: Schema,
    product: Id,
    definition: Id,
    /// The space of shapes, with its units.
    pub(super) space: Id,
    /// The space of curves in parameters.
    pub(super) parameters: Id,
    placement: Id,
}

impl Contexts {
    /// Lengths are known to `uncertainty`.
    pub(super) fn write(entities: &mut Entities, schema: Schema, unit: LengthUnit, uncertainty: f64) -> Self {
        let (application, protocol, year) = schema.protocol();
        let application = entities.add(format_args!("APPLICATION_CONTEXT({})", Quoted(application)));
        entities.add(format_args!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard',{},{year},{application})",
            Quoted(protocol)
        ));
        let (product, definition) = match schema {
            Schema::Ap203 => ("MECHANICAL_CONTEXT", "DESIGN_CONTEXT"),
            Schema::Ap214 | Schema::Ap242 => ("PRODUCT_CONTEXT", "PRODUCT_DEFINITION_CONTEXT"),
        };
        let product = entities.add(format_args!("{product}('',{application},'mechanical')"));
        let name = if schema == Schema::Ap203 { "" } else { "part definition" };
        let definition = entities.add(format_args!("{definition}({},{application},'design')", Quoted(name)));
        let length = unit.write(entities);
        let angle = entities.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        let solid_angle = entities.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
        let uncertainty = entities.add(format_args!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{length},'distance_accuracy_value','greatest distance of edges from their faces')",
            Real(uncertainty)
        ));
        let space = entities.add(format_args!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({uncertainty}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))REPRESENTATION_CONTEXT('','3D'))"
        ));
        let parameters = entities.add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('','2D'))",
        );
        let origin = entities.point(DVec3::ZERO);
        let [z, x] = [DVec3::Z, DVec3::X].map(|axis| entities.direction(axis));
        let placement = entities.add(format_args!("AXIS2_PLACEMENT_3D('',{origin},{z},{x})"));
        Self { schema, product, definition, space, parameters, placement }
    }

    /// A product of this name, whose shape is the items.
    pub(super) fn product(&self, entities: &mut Entities, name: &str, kind: &str, items: &[Id]) {
        let name = Quoted(name);
        let product = entities.add(format_args!("PRODUCT({name},{name},'',({}))", self.product));
        entities.add(format_args!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"));
        let formation = match self.schema {
            Schema::Ap203 => entities.add(format_args!(
                "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE('','',{product},.NOT_KNOWN.)"
            )),
            Schema::Ap214 | Schema::Ap242 => {
                entities.add(format_args!("PRODUCT_DEFINITION_FORMATION('','',{product})"))
            }
        };
        let definition =
            entities.add(format_args!("PRODUCT_DEFINITION('design','',{formation},{})", self.definition));
        let shape = entities.add(format_args!("PRODUCT_DEFINITION_SHAPE('','',{definition})"));
        let all: Vec<Id> = std::iter::once(self.placement).chain(items.iter().copied()).collect();
        let representation = entities.add(format_args!("{kind}({name},{},{})", List(&all), self.space));
        entities.add(format_args!("SHAPE_DEFINITION_REPRESENTATION({shape},{representation})"));
    }

    /// Items in a colour; returns the style, for [`Self::presentation`].
    pub(super) fn colour(&self, entities: &mut Entities, colour: DVec3, items: &[Id], styles: &mut Vec<Id>) {
        let [r, g, b] = colour.to_array().map(Real);
        let colour = entities.add(format_args!("COLOUR_RGB('',{r},{g},{b})"));
        let fill = entities.add(format_args!("FILL_AREA_STYLE_COLOUR('',{colour})"));
        let area = entities.add(format_args!("FILL_AREA_STYLE('',({fill}))"));
        let area = entities.add(format_args!("SURFACE_STYLE_FILL_AREA({area})"));
        let side = entities.add(format_args!("SURFACE_SIDE_STYLE('',({area}))"));
        let usage = entities.add(format_args!("SURFACE_STYLE_USAGE(.BOTH.,{side})"));
        let style = entities.add(format_args!("PRESENTATION_STYLE_ASSIGNMENT(({usage}))"));
        for item in items {
            styles.push(entities.add(format_args!("STYLED_ITEM('',({style}),{item})")));
        }
    }

    /// That items have styles.
    pub(super) fn presentation(&self, entities: &mut Entities, styles: &[Id]) {
        if !styles.is_empty() {
            entities.add(format_args!(
                "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{},{})",
                List(styles),
                self.space
            ));
        }
    }
}
