// circline._circline. What people import is apps/python/circline/__init__.py.
#include "apps/python/bindings.h"
#include "circline/version.h"

PYBIND11_MODULE(_circline, module) {
  namespace py = pybind11;
  module.doc() = "Camera pose from circles and parallel lines.";
  module.attr("__version__") = CIRCLINE_VERSION_STRING;
  py::register_exception<circline::python::Refused>(module, "Refused", PyExc_RuntimeError).doc() =
      "The evidence does not determine the answer; the message says what is missing.";
  circline::python::BindValues(&module);
  circline::python::BindResults(&module);
  circline::python::BindClosedForms(&module);
  circline::python::BindCalls(&module);
  circline::python::BindFiles(&module);
}
