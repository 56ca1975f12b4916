//! Settings of the core as Python classes: each keyword is one field, and what is not given keeps the core's default.

/// A frozen class over a settings struct of the core: its name, the core's type, and for each keyword the field.
macro_rules! settings_class {
    ($(#[$doc:meta])* $name:ident of $core:ty {
        $($(#[$about:meta])* $keyword:ident: $kind:ty = $($field:ident).+,)*
    }) => {
        $(#[$doc])*
        #[pyclass(frozen, eq, from_py_object, module = "surfsig")]
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            pub core: $core,
        }

        #[pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (*, $($keyword=None),*))]
            #[expect(clippy::too_many_arguments, reason = "keywords of the Python class")]
            fn new($($keyword: Option<$kind>),*) -> Self {
                let mut core = <$core>::default();
                $(if let Some(value) = $keyword {
                    core.$($field).+ = value;
                })*
                Self { core }
            }

            $($(#[$about])*
            #[getter]
            fn $keyword(&self) -> $kind {
                self.core.$($field).+
            })*

            fn __repr__(&self) -> String {
                let fields = [$(format!("{}={:?}", stringify!($keyword), self.core.$($field).+)),*];
                format!("{}({})", stringify!($name), fields.join(", "))
            }
        }
    };
}
pub(crate) use settings_class;
