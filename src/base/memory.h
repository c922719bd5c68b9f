#pragma once

namespace mouthpiece {

/// Returns what is free to the system; small blocks stay with the process otherwise.
void giveBackMemory();

}  // namespace mouthpiece
