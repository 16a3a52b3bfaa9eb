#include "replay/methods.hpp"
#include "replay/replay.hpp"

void replay::paper(const Recording& recording) {
  replay<tensegrity::LooseFilter<REPLAY_SCALAR>>("paper", recording);
}
