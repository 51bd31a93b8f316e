#include "report/detail/encode.h"

#include <gtest/gtest.h>
#include <zlib.h>

namespace coral::report::detail {
namespace {

TEST(Base64, agrees_with_the_vectors_of_RFC_4648)
{
    EXPECT_EQ(base64(""), "");
    EXPECT_EQ(base64("f"), "Zg==");
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foo"), "Zm9v");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(DeflateWords, inflates_to_low_bytes_then_high_bytes)
{
    const std::vector<std::uint16_t> words{0x1234, 0xfffe, 0x0001};
    const std::string packed = deflate_words(words);
    std::string planes(6, '\0');
    uLongf size = planes.size();
    ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(planes.data()), &size, reinterpret_cast<const Bytef*>(packed.data()), packed.size()), Z_OK);
    EXPECT_EQ(size, 6u);
    EXPECT_EQ(planes, std::string("\x34\xfe\x01\x12\xff\x00", 6));
}

TEST(ScriptSafe, leaves_nothing_that_ends_a_script_element)
{
    EXPECT_EQ(script_safe_source("a=\"</script>\";b='</SCRIPT '"), "a=\"<\\/script>\";b='<\\/SCRIPT '");
    EXPECT_EQ(script_safe_source("x</div>"), "x</div>");
    EXPECT_EQ(script_safe_json("{\"case\":\"</script><!--\"}"), "{\"case\":\"\\u003c/script>\\u003c!--\"}");
}

TEST(Html, escapes_what_markup_reads) { EXPECT_EQ(html("a<b & \"c\">"), "a&lt;b &amp; &quot;c&quot;&gt;"); }

}  // namespace
}  // namespace coral::report::detail
