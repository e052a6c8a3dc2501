//! Gives the shared library its name for the loader: programs that were linked to one version of its
//! interface do not start with another.

fn main() {
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let interface: Vec<_> = version.split('.').take(2).collect();
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libarmor.so.{}", interface.join("."));
    println!("cargo::rerun-if-changed=build.rs");
}
