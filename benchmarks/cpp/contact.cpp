// Decisions about the ground: the spin of a robot at rest, and which endcaps carry load.
#include "recording.hpp"
#include "runner.hpp"
#include "tensegrity/contact/detector.hpp"
#include "tensegrity/estimator/spin_start.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;

// Endcap centres of a recording [m], one after the other, and then from the start.
class Stream {
 public:
  explicit Stream(const std::string& recording) {
    for (const auto& sample : benchmarks::read_table(recording + "/endcaps.csv")) {
      endcaps_.push_back(Eigen::Map<const Endcaps<double>>(sample.values.data()));
    }
  }

  std::size_t size() const { return endcaps_.size(); }
  const Endcaps<double>& next() { return endcaps_[at_++ % endcaps_.size()]; }

 private:
  std::vector<Endcaps<double>> endcaps_;
  std::size_t at_ = 0;
};

void add_cases(Program& program, const std::string& recording) {
  const std::string suffix = "/" + benchmarks::recording_name(recording);
  const Stream endcaps(recording);
  program.add("contact/detector" + suffix,
              [endcaps] {
                return [detector = contact::Detector<double>({}), stream = endcaps]() mutable {
                  detector.update(stream.next(), 0.005);
                };
              },
              {1, int(endcaps.size())});
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  for (const bool known : {true, false}) {
    program.add(std::string("contact/spin_start/") + (known ? "flags" : "search"), [known] {
      Endcaps<double> h = Prism<double>().undeformed();
      Vector3<double> up = (h.col(3) - h.col(1)).cross(h.col(5) - h.col(1)).normalized();
      std::array<bool, 6> flags = {false, known, false, known, false, known};
      return [h, up, flags, found = SpinStart<double>()]() mutable {
        found = find_spin(h, up, flags, 0.02);
      };
    });
  }
  for (const std::string& recording : program.recordings()) add_cases(program, recording);
  return program.run();
}
