// Takes the place of SPIRV-Tools' optimiser in shaderc, see toolchain.cmake. build.rs asks for no optimisation, so that
// shaderc calls none of this; if it ever does, the compilation fails.

#include "spirv-tools/optimizer.hpp"

namespace spvtools {

struct Optimizer::Impl {};
struct Optimizer::PassToken::Impl {};

Optimizer::PassToken::PassToken(std::unique_ptr<Impl>) {}
Optimizer::PassToken::~PassToken() {}
Optimizer::PassToken CreateCompactIdsPass() { return std::unique_ptr<Optimizer::PassToken::Impl>(); }
Optimizer::PassToken CreateStripDebugInfoPass() { return std::unique_ptr<Optimizer::PassToken::Impl>(); }

Optimizer::Optimizer(spv_target_env) {}
Optimizer::~Optimizer() {}
void Optimizer::SetMessageConsumer(MessageConsumer) {}
Optimizer& Optimizer::RegisterPass(PassToken&&) { return *this; }
Optimizer& Optimizer::RegisterLegalizationPasses() { return *this; }
Optimizer& Optimizer::RegisterPerformancePasses() { return *this; }
Optimizer& Optimizer::RegisterSizePasses() { return *this; }
bool Optimizer::Run(const uint32_t*, size_t, std::vector<uint32_t>*, spv_optimizer_options) const { return false; }

}  // namespace spvtools
