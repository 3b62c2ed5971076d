use super::*;

const SQUARE: &str = "v 0 0 1\nv 1 0 1\nv 1 1 1 0.5 0.5 0.5\nv 0 1 1\n";

fn parsed(faces: &str) -> Result<GeometryFile, String> {
    let text = format!("{SQUARE}{faces}");
    parse("a.obj", text.as_bytes()).map_err(|error| error.to_string())
}

#[test]
fn all_ways_to_name_a_vertex_mean_the_same() {
    let expected = parsed("f 1 2 3 4").unwrap();
    assert_eq!(expected.mesh.len(), 2);
    for face in [
        "f 1/1 2/2 3/3 4/4",
        "f 1//7 2//7 3//7 4//7",
        "f 1/1/1 2/1/1 3/1/1 4/1/1",
        "f -4 -3 -2 -1",
    ] {
        assert_eq!(parsed(face).unwrap().mesh, expected.mesh);
    }
}

#[test]
fn groups_are_organs_objects_are_plants_and_materials_have_names() {
    let faces = "mtllib a.mtl\nvn 0 0 1\ns off\nf 1 2 3\n\
                 o oak\nusemtl bark\nf 1 2 3\ng leaf one\nusemtl leaf\nf 1 2 3\nf 2 3 4\n\
                 o elm\nf 1 2 3\ng leaf one\nf 1 2 3\n";
    let mesh = parsed(faces).unwrap();
    let organs: Vec<(&str, &str)> = mesh
        .organs
        .iter()
        .map(|organ| (organ.plant.as_str(), organ.id.as_str()))
        .collect();
    assert_eq!(
        organs,
        [
            ("default", "default"),
            ("oak", "oak"),
            ("oak", "leaf one"),
            ("elm", "elm"),
            ("elm", "leaf one")
        ]
    );
    assert_eq!(mesh.mesh.organ, [0, 1, 2, 2, 3, 4]);
    let names = ["default", "bark", "leaf"];
    assert_eq!(
        mesh.materials,
        names.map(|name| Material::Named(name.into()))
    );
    assert_eq!(mesh.mesh.material, [0, 1, 2, 2, 2, 2]);
}

#[test]
fn several_groups_of_a_line_name_one_organ() {
    let faces = "g leaf  plant2\t upper\nf 1 2 3\ng leaf plant2 upper\nf 1 2 3\ng leaf\nf 1 2 3\n";
    let file = parsed(faces).unwrap();
    let organs: Vec<&str> = file.organs.iter().map(|organ| organ.id.as_str()).collect();
    assert_eq!(organs, ["leaf plant2 upper", "leaf"]);
    assert_eq!(file.mesh.organ, [0, 0, 1]);
}

#[test]
fn fault_a_comment_behind_a_name_was_part_of_it() {
    let material = |line: &str| {
        let file = parsed(&format!("usemtl {line}\nf 1 2 3\n")).unwrap();
        file.materials[0].to_string()
    };
    assert_eq!(material("leaf # green"), "leaf");
    assert_eq!(material("leaf #green # 2"), "leaf");
    assert_eq!(material("leaf#2"), "leaf#2");
    // as some programs count
    assert_eq!(material("Material #25"), "Material #25");
    assert_eq!(material("#25 # green"), "#25");
    assert_eq!(material("# green"), UNNAMED);
}

#[test]
fn fault_statements_that_say_nothing_of_triangles_were_refused() {
    let plain = parsed("f 1 2 3").unwrap();
    let other = "usemap wood\nmg 1 0.5\nbevel on\nlod 3\nmaplib a.map\nshadow_obj a.obj\nvp 0.1 0.2\n\
                 trace_obj a.obj\nc_interp on\nd_interp off\nl 1 2\np 1\nvw 1 0.5\nt crease 1 2\nvt 0 0\nvn 0 0 1\ns off\n";
    assert_eq!(parsed(&format!("{other}f 1 2 3")).unwrap().mesh, plain.mesh);
    let curved = "cstype bspline\ndeg 3\ncurv 0.0 1.0 1 2 3 4\nparm u 0 0 0 \\\n 1 1 1\nend\n";
    let file = parsed(&format!("{curved}f 1 2 3")).unwrap();
    assert_eq!(file.mesh, plain.mesh);
    let warning = "curves and curved surfaces are ignored, the first in a.obj, line 7";
    assert_eq!(file.warnings, [warning]);
}

#[test]
fn fault_a_backslash_at_the_end_of_a_line_was_refused() {
    let expected = parsed("f 1 2 3 4").unwrap();
    for face in [
        "f 1 2 \\\n3 4",
        "f 1 2\\\r\n3\\\r 4",
        "f \\\n\\\n 1 2 3 4\\\n",
        "# C:\\plants\\\nf 1 2 3 4 # C:\\\n",
        "f 1 2 3 4 \\",
    ] {
        assert_eq!(parsed(face).unwrap().mesh, expected.mesh, "{face}");
    }
    let error = parsed("g a \\\n b\n\nf 1 \\\n 2 9\n").unwrap_err();
    assert!(error.starts_with("a.obj, line 8: "), "{error}");
    let many = format!("f 1 {}2 3 4", "\\\n".repeat(400_000));
    assert_eq!(parsed(&many).unwrap().mesh, expected.mesh);
    let error = parsed(&"\\\n".repeat(600_000)).unwrap_err();
    assert!(error.contains("a line of at most"), "{error}");
}

#[test]
fn fault_a_lone_carriage_return_did_not_end_a_line() {
    let text = format!("{SQUARE}# square\nf 1 2 3 4\n");
    let expected = parse("a.obj", text.as_bytes()).unwrap();
    for end in ["\r", "\r\n", "\n\r"] {
        let other = text.replace('\n', end);
        let found = parse("a.obj", other.as_bytes()).unwrap();
        assert_eq!(found.mesh, expected.mesh, "{end:?}");
    }
}

#[test]
fn fault_faces_before_their_vertices_were_refused() {
    let faces = "f 1 2 3 4\n";
    let before = parse("a.obj", format!("{faces}{SQUARE}").as_bytes()).unwrap();
    assert_eq!(before.mesh, parsed(faces).unwrap().mesh);
    for (text, expected) in [
        (
            format!("f 5 1 2\n{SQUARE}"),
            "a vertex from 1 to 4, found '5'",
        ),
        (
            format!("f -1 1 2\n{SQUARE}"),
            "a vertex from 1 to 4, found '-1'",
        ),
        (
            format!("v 0 0 0\nf -2 1 2\n{SQUARE}"),
            "a vertex from 1 to 5, or from -1 to -1, found '-2'",
        ),
        (
            "f 1 2 3".to_owned(),
            "vertices (v) for the faces of the file, found '1'",
        ),
    ] {
        let error = parse("a.obj", text.as_bytes()).unwrap_err().to_string();
        assert!(error.ends_with(expected), "{error}");
    }
}

#[test]
fn a_concave_face_is_cut_into_its_area() {
    let text = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n";
    let file = parse("a.obj", text.as_bytes()).unwrap();
    let corners = (0..file.mesh.len()).map(|t| file.mesh.triangle(t).corners_m);
    let areas: Vec<f64> = corners
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z)
        .collect();
    assert!(areas.iter().all(|area| *area > 0.0));
    assert_eq!(areas.iter().sum::<f64>(), 3.0);
    assert_eq!(
        parsed("f 1 3 2 4").unwrap_err(),
        "a.obj, line 5: expected a polygon whose edges do not cross, found a crossing of the edges \
         that begin at vertex 1 and at vertex 3"
    );
    let many = format!("f{}", " 1".repeat(MAX_VERTICES + 1));
    let error = parsed(&many).unwrap_err();
    assert!(
        error.contains("a face of at most 10000 vertices"),
        "{error}"
    );
}

#[test]
fn faces_without_their_vertices_are_refused() {
    for face in [
        "f 1 2 5",
        "f 0 1 2",
        "f -5 1 2",
        "f 1 2 x",
        "f 1 2 99999999999999999999",
    ] {
        let error = parsed(face).unwrap_err();
        let expected = "a.obj, line 5: expected a vertex from 1 to 4, or from -4 to -1, found ";
        assert!(error.starts_with(expected), "{error}");
    }
    assert_eq!(
        parsed("f 1 2\n").unwrap_err(),
        "a.obj, line 5: expected at least 3 vertices, found the end of the line"
    );
}

#[test]
fn garbled_files_are_refused() {
    for (text, expected) in [
        (
            "v 0 0\n",
            "line 5: expected z of vertex 5, a finite number, found the end of the line",
        ),
        (
            "v 0 nan 0\n",
            "line 5: expected y of vertex 5, a finite number, found 'nan'",
        ),
        (
            "<html>\n",
            "line 5: expected an OBJ statement (v, f, g, o, usemtl, ...), found '<html>'",
        ),
    ] {
        assert_eq!(parsed(text).unwrap_err(), format!("a.obj, {expected}"));
    }
    assert!(parse("a.obj", b"o \xff\xfe\n").is_err());
}

#[test]
fn long_names_cannot_fill_the_memory() {
    let name = "x".repeat(256);
    assert!(
        parsed(&format!("o {name}\n"))
            .unwrap_err()
            .contains("at most 255 bytes")
    );
    assert!(parsed(&format!("o {}\nf 1 2 3", &name[1..])).is_ok());
}
