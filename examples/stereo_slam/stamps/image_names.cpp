// SPDX-License-Identifier: MIT
#include "stereo_slam/stamps/image_names.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>

namespace stereo_slam {

bool natural_less(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string x = number(a, i);
    const std::string y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;
}

NumberedName::NumberedName(std::string name) : text(std::move(name)) {
  constexpr std::size_t kMostDigits = 12;  // without zeros before them
  constexpr std::size_t kMostWritten = 20;
  const auto last_letter = text.find_last_not_of("0123456789");
  const std::string digits = text.substr(last_letter == std::string::npos ? 0 : last_letter + 1);
  const std::size_t zeros = std::min(digits.find_first_not_of('0'), digits.size());
  if (digits.empty() || digits.size() > kMostWritten || digits.size() - zeros > kMostDigits) return;
  number = std::stoull(digits);
  text.resize(text.size() - digits.size());
}

}  // namespace stereo_slam
