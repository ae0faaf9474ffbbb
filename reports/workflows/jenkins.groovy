// Written by `rayproof new workflow jenkins`: a Jenkinsfile. The report is kept in any case.
pipeline {
    agent { docker { image 'python:3.12'; args '--user root' } }
    options { timeout(time: 1, unit: 'HOURS') }
    stages {
        stage('rayproof') {
            steps {
                sh '''
                    @BUILD@
                '''
                sh '''
                    python -m venv .rayproof
                    .rayproof/bin/python -m pip install @INSTALL@
                    PATH="$PWD/.rayproof/bin:$PATH" @RUN@
                '''
            }
        }
    }
    post {
        always {
            junit testResults: '@OUT@/junit.xml', allowEmptyResults: true
            archiveArtifacts artifacts: '@OUT@/**', allowEmptyArchive: true
        }
    }
}
