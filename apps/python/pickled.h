// Values that Python can copy, pickle and send to another process: as tuples of their fields.
#ifndef CIRCLINE_APPS_PYTHON_PICKLED_H_
#define CIRCLINE_APPS_PYTHON_PICKLED_H_

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "apps/python/bindings.h"
#include "circline/refine/adjust_photos.h"

namespace circline::python {

// A field, to and from Python.
template <typename Field>
pybind11::object Saved(const Field& field) {
  return pybind11::cast(field);
}
template <typename Field>
void Restore(const pybind11::handle& saved, Field* field) {
  *field = saved.cast<Field>();
}

// Those that Python has no class for.
inline pybind11::object Saved(const Status& status) {
  return pybind11::make_tuple(static_cast<int>(status.code), status.message);
}
inline void Restore(const pybind11::handle& saved, Status* status) {
  const auto parts = saved.cast<pybind11::tuple>();
  *status = {static_cast<StatusCode>(parts[0].cast<int>()), parts[1].cast<std::string>()};
}
inline pybind11::object Saved(const std::vector<AdjustedResidual>& residuals) {
  pybind11::list rows;
  for (const AdjustedResidual& r : residuals)
    rows.append(pybind11::make_tuple(r.pixel.x(), r.pixel.y(), r.offset.x(), r.offset.y()));
  return rows;
}
inline void Restore(const pybind11::handle& saved, std::vector<AdjustedResidual>* residuals) {
  for (const pybind11::handle row : saved) {
    const auto r = row.cast<std::array<double, 4>>();
    residuals->push_back({{r[0], r[1]}, {r[2], r[3]}});
  }
}

// For `def` of a class: a copy has all that these fields hold.
template <typename T, typename... Field>
auto Pickled(Field T::*... fields) {
  return pybind11::pickle(
      [=](const T& value) { return pybind11::make_tuple(Saved(value.*fields)...); },
      [=](const pybind11::tuple& state) {
        T value;
        std::size_t i = 0;
        (Restore(state[i++], &(value.*fields)), ...);
        return value;
      });
}

}  // namespace circline::python

#endif  // CIRCLINE_APPS_PYTHON_PICKLED_H_
