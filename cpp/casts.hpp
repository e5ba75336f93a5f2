// Whole numbers from floating ones, whatever these are.
#pragma once

namespace fieldalign {

// v towards zero, but no less than `low` and no more than `high`, which Real must hold exactly; `low` where v is NaN.
// A plain cast of what does not fit is undefined, and is another number on each machine.
template <class Whole, class Real>
Whole cast_within(Real v, Whole low, Whole high) {
  const Real least = static_cast<Real>(low), most = static_cast<Real>(high);
  return static_cast<Whole>(v > least ? (v < most ? v : most) : least);
}

}  // namespace fieldalign
