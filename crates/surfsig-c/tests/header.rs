//! The header that is checked in is the one that the sources say.

use std::fmt::Write;
use std::path::Path;
use surfsig_c::{EXTRACTION_COLUMNS, SURFACE_COLUMNS, Table};

#[test]
fn the_header_is_that_of_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    config.trailer = Some(declarations_of_columns(&[EXTRACTION_COLUMNS, SURFACE_COLUMNS]));
    let mut generated = Vec::new();
    cbindgen::generate_with_config(folder, config).unwrap().write(&mut generated);
    let path = folder.join("include/surfsig.h");
    if std::env::var_os("SURFSIG_WRITE_HEADER").is_some() {
        std::fs::write(&path, &generated).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap().replace("\r\n", "\n");
    assert!(kept == String::from_utf8(generated).unwrap(), "the header is out of date: run `make header`");
}

/// The functions that give columns, which cbindgen does not see since a macro makes them, and lists of the columns for
/// programs that do something with each of them.
fn declarations_of_columns(tables: &[Table]) -> String {
    let mut text = String::from("#ifdef __cplusplus\nextern \"C\" {\n#endif  // __cplusplus\n");
    for Table { handle, columns } in tables {
        let parameter = handle.strip_prefix("surfsig_").unwrap();
        for column in *columns {
            text += "\n/**\n";
            for line in column.comment {
                writeln!(text, " *{line}").unwrap();
            }
            writeln!(text, " */\nconst {} *{}(const {handle} *{parameter});", column.c_type, column.function)
                .unwrap();
        }
        let list = format!("{}_COLUMNS", handle.to_uppercase());
        write!(
            text,
            "\n/**\n * X(type, name, width) for each column of a {handle}: {handle}_##name() gives it, width values a\n \
             * row.\n */\n#define {list}(X)"
        )
        .unwrap();
        for column in *columns {
            let name = column.function.strip_prefix(&format!("{handle}_")).unwrap();
            write!(text, " \\\n  X({}, {name}, {})", column.c_type, column.width).unwrap();
        }
        text.push('\n');
    }
    text + "\n#ifdef __cplusplus\n}  // extern \"C\"\n#endif  // __cplusplus"
}
