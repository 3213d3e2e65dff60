// A function of a template's scalar that is chosen at run time: a generic lambda, kept once for
// each scalar of a list.
#pragma once

#include <functional>
#include <tuple>

namespace trueline {

// In<T> is the argument, Out<T> the result.
template <template <class> class In, template <class> class Out, class... Scalars>
class ForScalars {
 public:
  template <class Function>
  explicit ForScalars(const Function& function) : by_scalar_{Of<Scalars>(function)...} {}

  template <class T>
  Out<T> operator()(const In<T>& in) const {
    return std::get<Of<T>>(by_scalar_)(in);
  }

 private:
  template <class T>
  using Of = std::function<Out<T>(const In<T>&)>;

  std::tuple<Of<Scalars>...> by_scalar_;
};

}  // namespace trueline
