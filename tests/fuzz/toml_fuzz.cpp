// Every kind of question the tools ask of a configuration, on text of any kind.
#include <array>

#include "core/config.h"
#include "core/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    using namespace coral;
    const std::string text(reinterpret_cast<const char*>(data), size);
    try {
        const Config config = Config::from_text(text, "fuzz.toml");
        const ConfigTable& root = config.root();
        root.quantity("length", Dimension::length, 1.0);
        root.integer("count", 1);
        root.boolean("flag", false);
        root.string("name", "");
        root.choice("choice", std::array<std::string, 2>{"a", "b"}, "a");
        root.vector("vector", Dimension::velocity, Eigen::Vector3d::Zero().eval());
        root.quantities("list", Dimension::length, std::vector<double>{});
        root.strings("names", std::vector<std::string>{});
        root.integers("numbers", std::vector<std::int64_t>{});
        for (const std::string& key : root.table("table").keys()) root.table("table").table(key).quantity("length", Dimension::length);
        for (const ConfigTable& item : root.tables("item")) item.integer("count");
        config.finish();
    } catch (const Error&) {
    }
    return 0;
}
