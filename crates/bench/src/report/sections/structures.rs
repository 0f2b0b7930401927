//! Structures beside each other.

use crate::report::{Plot, PlotKind, Section};
use crate::structures::StructuresReport;
use crate::table::{Table, number, optional};

/// A section for each scene.
pub fn structures(report: &StructuresReport) -> Vec<Section> {
    let mut sections = Vec::new();
    for scene in &report.scenes {
        let method = format!(
            "{} triangles. Rays of one thread, medians of {} runs in turns; nodes are what a structure opens on its way: \
             boxes, cells, texels. Answers are held against those of the hierarchy \"bvh\".",
            scene.triangles, report.runs
        );
        let mut section = Section::new(format!("Structures, {}", scene.scene)).text(method);
        let mut groups: Vec<(String, Vec<f64>)> = Vec::new();
        let names: Vec<&str> = scene.structures.iter().map(|s| s.name.as_str()).collect();
        for class in &scene.classes {
            let mut table = Table::new(&[
                "structure",
                "ns a ray",
                "nodes a ray",
                "tests a ray",
                "rays",
                "hits",
                "other answers",
            ]);
            let mut lengths = vec![f64::NAN; names.len()];
            for row in &class.rows {
                let place = names.iter().position(|name| *name == row.structure);
                if let (Some(place), Some(ns)) = (place, row.ns_per_ray) {
                    lengths[place] = ns;
                }
                table.row(vec![
                    row.structure.clone(),
                    row.ns_per_ray.map_or("OTHER ANSWERS".into(), number),
                    optional(row.nodes_per_ray),
                    optional(row.tests_per_ray),
                    row.rays.to_string(),
                    row.hits.to_string(),
                    row.differing.to_string(),
                ]);
            }
            groups.push((class.class.into(), lengths));
            section = section.table(format!("{}: {}", class.class, class.what), table);
        }
        let mut built = Table::new(&["structure", "build ms", "bytes", "what it is"]);
        for structure in &scene.structures {
            built.row(vec![
                structure.name.clone(),
                number(structure.build_ms),
                structure.bytes.map_or("-".into(), |bytes| bytes.to_string()),
                structure.what.into(),
            ]);
        }
        section = section.table("Builds", built);
        sections.push(section.plot(Plot {
            name: format!("structures-{}", scene.scene),
            caption: format!(
                "Nanoseconds a ray in {}; what is not drawn does not take such rays.",
                scene.scene
            ),
            kind: PlotKind::Bars {
                axis: "ns a ray".into(),
                series: names.into_iter().map(str::to_owned).collect(),
                groups,
                mark: None,
            },
        }));
    }
    sections
}
