#include "replay/methods.hpp"
#include "replay/replay.hpp"

void replay::full(const Recording& recording) {
  replay<tensegrity::TightFilter<REPLAY_SCALAR>>("full", recording);
}
