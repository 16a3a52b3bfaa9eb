// Two-way ranging over arrays of timestamps.
#include "bindings.hpp"
#include "tensegrity/ranging/two_way.hpp"

namespace tensegrity::bindings {

namespace {

using Counters = py::array_t<std::uint64_t, py::array::c_style>;
using Doubles = py::array_t<double>;

std::tuple<Doubles, Doubles, py::array_t<std::uint8_t>> two_way_ranges(const Counters& stamps) {
  if (stamps.ndim() != 2 || stamps.shape(1) != 6) {
    throw py::value_error("stamps: expected shape (N, 6), counter values [ticks]");
  }
  const py::ssize_t exchanges = stamps.shape(0);
  Doubles ranges(exchanges), drifts(exchanges);
  py::array_t<std::uint8_t> statuses(exchanges);
  const std::uint64_t* s = stamps.data();
  for (py::ssize_t k = 0; k < exchanges; ++k, s += 6) {
    const auto result = ranging::two_way_range<double>({s[0], s[1], s[2], s[3], s[4], s[5]});
    ranges.mutable_data()[k] = result.range;
    drifts.mutable_data()[k] = result.drift;
    statuses.mutable_data()[k] = static_cast<std::uint8_t>(result.status);
  }
  return {ranges, drifts, statuses};
}

}  // namespace

void bind_ranging(py::module_& m) {
  m.def("two_way_ranges", &two_way_ranges, py::arg("stamps"),
        "Raw ranges (N,) [m], relative drifts (N,) [1] and statuses (N,), as numbers of Status, of "
        "exchanges (N, 6): poll sent, received, response sent, received, final sent, received.");
  m.attr("SPEED_OF_LIGHT") = ranging::kSpeedOfLight;
  m.attr("DWM1000_TICK_S") = ranging::kTickSeconds;
}

}  // namespace tensegrity::bindings
