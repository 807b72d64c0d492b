# openapi-generator typescript-fetch: compiled by tsc without a word, run by Node.
generate typescript-fetch typescript
cp "$here/try.ts" typescript/try.ts
npm init -y > /dev/null
npm install --silent typescript@5.9.3 @types/node@20 > /dev/null
cat > tsconfig.json <<'JSON'
{"compilerOptions": {"outDir": "js", "target": "es2022", "module": "commonjs", "moduleResolution": "node",
  "strict": true, "lib": ["es2022", "dom"], "types": ["node"], "rootDir": "typescript"}, "include": ["typescript"]}
JSON
npx tsc -p tsconfig.json
node js/try.js "$url" cloud.xyz
