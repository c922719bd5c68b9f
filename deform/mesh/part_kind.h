#pragma once

#include <optional>
#include <string_view>

namespace mouthpiece {

/// What a part of the head is, and so what moves it: the control surface moves skin; the jaw moves lower teeth
/// and the tongue's root; eyes, upper teeth and hair stay.
enum class PartKind { kSkin, kLips, kUpperTeeth, kLowerTeeth, kTongue, kMouthInside, kEye, kHair, kOther };
/// Skin and lips: what markers lie on.
constexpr bool isSkin(PartKind kind) { return kind == PartKind::kSkin || kind == PartKind::kLips; }
/// "skin", "lips", "upper_teeth", ...: the names of part kinds in files.
std::string_view nameOf(PartKind kind);
std::optional<PartKind> partKindFromName(std::string_view name);

}  // namespace mouthpiece
