// What solves the linear systems of Ipopt.
//
// Debian's Ipopt comes with MUMPS, which is made for large sparse systems: the twenty equations of
// a shape are done in a hundredth of the time that it takes to keep its books about them. Ipopt
// takes any solver with the interface of HSL's MA27 (HSLLoader.h), here LAPACK's dense L D L' with
// Bunch-Kaufman pivots. The iterates are the same, to rounding.
#pragma once

namespace tensegrity::shape {

// For Ipopt's option `linear_solver`: "ma27", which from then on is the dense one in all of the
// process, unless Ipopt has an MA27 already; "mumps" for an Ipopt that cannot be given one.
const char* ipopt_linear_solver();

}  // namespace tensegrity::shape
