import tseslint from "typescript-eslint";

export default tseslint.config({ ignores: ["dist", "node_modules"] }, ...tseslint.configs.recommended, {
  rules: { "no-console": "error", eqeqeq: "error", "prefer-const": "error" },
});
