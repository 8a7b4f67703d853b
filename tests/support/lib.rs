//! Common code of the workspace's tests.
