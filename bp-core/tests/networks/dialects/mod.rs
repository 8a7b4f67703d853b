//! Small files of every dialect, and reading one.
//!
//! In: nothing. Out: texts. Invariant: the files of XMLBIF, Hugin NET and UAI describe the same network.

use bp_core::compiler::io::{self, Format, Network};
use bp_core::compiler::source::Source;

/// Reads a correct text.
pub(crate) fn read(format: Format, text: &str) -> Network {
    let source = Source::new("network", text);
    io::read(&source, format).unwrap_or_else(|wrong| panic!("{}\n{text}", wrong.render(&source, false)))
}

/// BIF with all its dialects.
pub(crate) const ASIA_LIKE: &str = "\u{feff}// made by hand\r
network \"Chest clinic\" { property author \"J. Doe; others\"; }\r
# a comment\r
variable smoke { //2 values\r
\ttype discrete[2] { yes, no };\r
\tproperty position = (10, 20)\r
}\r
variable \"x ray\" { type discrete [ 3 ] { \"<5\" \"Asy/Patch\" >=7.5 }; }\r
probability ( \"x ray\" | smoke ) { /* rows\r
in any order */\r
  (no) .2 .3 .5;\r
  (yes) 1e-1, 2.e-1, 0.7\r
}\r
probability ( smoke ) { table 0.6, 0.3999; }\r
";

/// XMLBIF.
pub(crate) const XML: &str = r#"<?xml version="1.0"?>
<!DOCTYPE BIF [ <!ELEMENT BIF (NETWORK)*> ]>
<BIF VERSION="0.3"><NETWORK><NAME>n</NAME>
<VARIABLE TYPE="nature"><NAME>a</NAME><OUTCOME>&lt;5</OUTCOME><OUTCOME> x </OUTCOME><PROPERTY>p = (1,2)</PROPERTY></VARIABLE>
<VARIABLE TYPE="nature"><NAME>b</NAME><OUTCOME>0</OUTCOME><OUTCOME>1</OUTCOME></VARIABLE>
<DEFINITION><FOR>b</FOR><GIVEN>a</GIVEN><TABLE>0.1 0.9 <!-- second row --> .25 .75</TABLE></DEFINITION>
<DEFINITION><FOR>a</FOR><TABLE>0.5 0.5</TABLE></DEFINITION>
</NETWORK></BIF>"#;

/// The same network in Hugin NET.
pub(crate) const NET: &str = r#"net { node_size = (80 40); name = "n"; }
% a comment
node a { label = "say \"a\""; states = ("<5" "x"); position = (1 2); }
discrete node b { states = ("0" "1") }
potential (b | a) { data = ((0.1 0.9) %row
 (.25 .75)); }
potential (a) { data = (0.5 0.5); }
"#;

/// The same in UAI.
pub(crate) const UAI: &str = "BAYES\n2\n2 2\n2\n1 0\n2 0 1\n\n2\n 0.5 0.5\n\n4\n 0.1 0.9\n .25 .75\n";

/// A Markov network.
pub(crate) const MARKOV: &str = "MARKOV\n2\n2 3\n2\n1 0\n2 0 1\n2 1 3\n6 1 2 0 4 5 10\n";
