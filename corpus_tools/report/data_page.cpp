#include "corpus_tools/report/data_page.h"

#include "base/errors.h"
#include "base/page_data.h"

namespace mouthpiece {

extern const std::string_view kPageStyle;
extern const std::string_view kPageTools;

namespace {

std::string filled(const std::string& page, std::string_view place, std::string_view text) {
  const std::size_t at = page.find(place);
  MOUTHPIECE_EXPECT(at != std::string::npos);
  return page.substr(0, at).append(text).append(page, at + place.size());
}

}  // namespace

std::string dataPage(std::string_view page, std::string_view json) {
  // The data last: what it holds is no place of the page.
  return closedPage(filled(filled(filled(std::string(page), "/*STYLE*/", kPageStyle), "/*TOOLS*/", kPageTools),
                           "/*REPORT*/null", scriptSafe(json)));
}

}  // namespace mouthpiece
