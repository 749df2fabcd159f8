// SPDX-License-Identifier: MIT
#include "images.hpp"

#include <cstdint>
#include <stdexcept>
#include <string>

namespace py = pybind11;

namespace {

[[noreturn]] void refuse(const py::array& array, const std::string& what) {
  throw std::invalid_argument("an image has the shape " + std::string(py::str(array.attr("shape"))) +
                              " and the type " + std::string(py::str(array.dtype())) + ", " + what);
}

}  // namespace

cv::Mat image_in(const py::object& object) {
  if (object.is_none()) return {};
  if (!py::isinstance<py::array>(object))
    throw std::invalid_argument("an image is no numpy array, but " +
                                std::string(py::str(py::type::of(object).attr("__name__"))));
  const auto array = py::reinterpret_borrow<py::array>(object);
  const bool is_8_bit = py::isinstance<py::array_t<std::uint8_t>>(array);
  if (!is_8_bit && !py::isinstance<py::array_t<std::uint16_t>>(array))
    refuse(array, "which is none of uint8 and uint16");
  const py::ssize_t channels = array.ndim() == 3 ? array.shape(2) : 1;
  if (array.ndim() < 2 || array.ndim() > 3 || (channels != 1 && channels != 3 && channels != 4))
    refuse(array, "which is not rows x columns, nor that x 1, 3 (BGR) or 4 (BGRA) channels");
  const py::ssize_t pixel_bytes = channels * array.itemsize();
  const bool is_packed = array.strides(1) == pixel_bytes &&
                         array.strides(0) >= pixel_bytes * array.shape(1) &&
                         (channels == 1 || array.strides(2) == array.itemsize());
  if (!is_packed) refuse(array, "whose pixels are not side by side; copy it by numpy.ascontiguousarray");
  // The SLAM does not write to images, so that an array may be read-only.
  return {static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)),
          CV_MAKETYPE(is_8_bit ? CV_8U : CV_16U, static_cast<int>(channels)), const_cast<void*>(array.data()),
          static_cast<std::size_t>(array.strides(0))};
}
