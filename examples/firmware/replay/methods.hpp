// The methods of the package. Each is compiled by itself, so that an image holds what it uses.
#pragma once

#include "replay/recording.hpp"

namespace replay {

void paper(const Recording& recording);  // LooseFilter: T's estimator
void full(const Recording& recording);   // TightFilter

}  // namespace replay
