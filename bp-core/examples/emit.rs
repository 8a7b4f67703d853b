//! scratch
fn main() {
    for path in std::env::args().skip(1) {
        let source = bp_core::source::Source::new(&path, std::fs::read_to_string(&path).unwrap());
        let model = bp_core::syntax::compile(&source).unwrap_or_else(|w| panic!("{}", w.render(&source, false)));
        println!("pub mod {} {{\n{}\n}}", bp_core::emit::snake(&model.name), bp_core::emit::emit_rust(&model, &source).unwrap_or_else(|e| panic!("{e:?}")));
    }
}
